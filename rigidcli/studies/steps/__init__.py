"""The working of the studies of bodies, step by step, as a textbook would show it, and how it is written."""
