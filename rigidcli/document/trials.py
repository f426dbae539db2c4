"""Checks of a document with symbols: it is read with trial values, for which its bodies must be possible."""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from rigidcli.bodies.bodies import Composite
from rigidcli.bodies.shape import Shape
from rigidcli.core.arithmetic import FLOAT
from rigidcli.document.document import Document
from rigidcli.document.draft import Draft
from rigidcli.errors import ComputationError, DocumentError, ValueProblem, at
from rigidcli.fields.environment import Formula

TRIALS = 30
"""Sets of trial values: a body that one set in ten allows is wrongly refused once in twenty-five cases."""

MOST_SYMBOLS = 3
"""With more symbols, values that allow a body may be missed by chance: then it is noted, and not refused."""


def tried(document: Document, draft: Draft, read: Callable[[Mapping[str, Any]], Document]) -> Document:
    """The document, with notes on checks that fail for some positive values of its symbols.

    `read` reads a tree with trial values, without a check that the body can exist. Notes and problems name
    the check that fails, without the values. Raises DocumentError where all values fail.
    """
    parameters = draft.tree["parameters"]
    symbols = [name for name, value in parameters.items() if value is None]
    chance = random.Random(" ".join(symbols))  # noqa: S311 - the same trials for the same document
    failed: Counter[tuple[str, str]] = Counter()
    for _ in range(TRIALS):
        values = {name: 10 ** chance.uniform(-2, 2) for name in symbols}
        try:
            _require_physical(read({**draft.tree, "parameters": {**parameters, **values}}))
        except DocumentError as error:
            failed.update({(problem.key, _check(problem.message)) for problem in error.problems})
        except ValueProblem as problem:
            failed[".".join(map(str, problem.path)), _check(problem.message)] += 1
        except ComputationError:
            continue
    refused = []
    names = ", ".join(f"`{name}`" for name in symbols)
    for (key, check), count in failed.items():
        amount = "all" if count == TRIALS else "some"
        sentence = f"for {amount} positive values of {names} that were tried: {check}"
        if count == TRIALS and len(symbols) <= MOST_SYMBOLS:
            refused.append(document.problem(sentence, key))
        else:
            document.reading.environment.notes.append(f"{key}: {sentence}" if key else sentence)
    if refused:
        raise DocumentError(refused)
    return document


def _require_physical(document: Document) -> None:
    """Raise ValueProblem for an impossible body or top; densities are sampled, and not integrated."""
    varying = [shape for shape in _shapes(document.body) if isinstance(shape.density, Formula)]
    for shape in varying:
        from rigidcli.bodies.density_integrals import looked_at

        with at("body"):
            looked_at(shape.density, shape.maps(FLOAT), shape.UNIT)
    if not varying:
        document.physical.require()


def _shapes(body: object) -> Iterator[Shape]:
    """The shapes that a body consists of."""
    for part in body.parts if isinstance(body, Composite) else ():
        yield from _shapes(part)
    if isinstance(body, Shape):
        yield body


def _check(message: str) -> str:
    """A message without the numbers that only a trial has."""
    expected = message.partition("expected ")[2]
    if message.startswith("read ") and expected:
        return f"expected {expected}"
    return re.split(r"[:(]| by up to|,? -?\d", message)[0].strip()
