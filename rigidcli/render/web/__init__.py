"""Pages that a browser shows without a network: the frame of a page, and what moves in it."""
