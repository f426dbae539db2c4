"""The room `samples` under a name that `principal` still has."""

from rigidcli.grading.samples import as_typed, told

__all__ = ["as_typed", "told"]
