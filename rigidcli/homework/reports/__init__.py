"""Judgements -> text, piece by whole piece."""
