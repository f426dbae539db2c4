"""Lists and tables of numbers or expressions: entries, keys, and mistakes in them."""
