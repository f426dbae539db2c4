"""Lists and tables of numbers or expressions: their entries, and the mistakes made in them."""
