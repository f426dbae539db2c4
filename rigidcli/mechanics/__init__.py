"""Mechanics by algebra: Legendre transform, Hamilton's equations, canonical changes, principal axes."""
