"""The working of the studies of bodies, step by step, as in a textbook."""
