"""Trajectories: tables in time beside a reference that may be asked at any time."""
