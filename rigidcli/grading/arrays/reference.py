"""The room `samples` under a name that `principal` still has."""

from rigidcli.grading.samples import Reference

__all__ = ["Reference"]
