"""Numbers and quantities: the key, what is near to it, and the mistakes that explain what is not."""
