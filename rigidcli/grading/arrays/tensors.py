"""The room `tensors` under a name that `principal` still has."""

from rigidcli.grading.tensors import mistaken_tensors

__all__ = ["mistaken_tensors"]
