"""Documents: their text, their sections, and the values that options set."""
