"""Exact expressions: arithmetic, functions, calculus, simplification."""
