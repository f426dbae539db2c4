"""The room `samples` under a name that `principal` still has."""

from rigidcli.grading.samples import Cell, Entry, filled, read_entry, worked

__all__ = ["Cell", "Entry", "filled", "read_entry", "worked"]
