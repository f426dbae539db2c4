"""Expressions as functions: read, evaluated with a bound on rounding, and compared."""
