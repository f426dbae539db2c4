"""Judging of homework: what an assignment asks, what is handed in, whether it is right, and what is said of it."""
