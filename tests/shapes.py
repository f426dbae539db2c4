"""Dimensions for every shape, as a document has them, of numbers that are exact and unlike each other."""

from __future__ import annotations

from tests.tables import rows_of

DIMENSIONS: dict[str, str] = rows_of(__file__, "dimensions")
