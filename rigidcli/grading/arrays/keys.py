"""The room `samples` under a name that `principal` still has."""

from rigidcli.grading.samples import computed, reference

__all__ = ["computed", "reference"]
