"""Equations of motion: read, and judged by the motion that they determine."""
