"""The working of each study, step by step, as a textbook would show it."""
