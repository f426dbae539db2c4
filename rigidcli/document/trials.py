"""Checks of a document with symbols: it is read with values for them, and must describe what can exist."""

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
from rigidcli.errors import ComputationError, DocumentError, Problem, ValueProblem
from rigidcli.errors import Path as Keys
from rigidcli.fields.environment import Formula

TRIALS = 30
"""Sets of values: a body that one set in ten allows is refused once in twenty-five cases."""

MOST_SYMBOLS = 3
"""With more symbols, values that allow a body may be missed by chance: then it is noted, and not refused."""

Read = Callable[[Mapping[str, Any]], Document]
"""Reads a tree with numbers as a document, and raises DocumentError with all problems; no physics yet."""


def tried(tree: Mapping[str, Any], read: Read) -> Iterator[tuple[Problem, str, bool]]:
    """What forbids some of the positive values of the symbols of a document.

    Each problem comes with a sentence on the check that fails, without the values, and whether it fails for
    all of them.
    """
    parameters = tree["parameters"]
    symbols = [name for name, value in parameters.items() if value is None]
    chance = random.Random(" ".join(symbols))  # noqa: S311 - the same trials for the same document
    failed: Counter[tuple[str, str]] = Counter()
    problems: dict[tuple[str, str], Problem] = {}
    for _ in range(TRIALS):
        values = {name: 10 ** chance.uniform(-2, 2) for name in symbols}
        try:
            _require_physical(read({**tree, "parameters": {**parameters, **values}}))
        except DocumentError as error:
            for key, problem in {(each.key, _check(each.message)): each for each in error.problems}.items():
                failed[key] += 1
                problems[key] = problem
        except ComputationError:
            continue
    names = ", ".join(f"`{name}`" for name in symbols)
    for failure, count in failed.items():
        always = count == TRIALS and len(symbols) <= MOST_SYMBOLS
        amount = "all" if count == TRIALS else "some"
        sentence = f"for {amount} positive values of {names} that were tried: {failure[1]}"
        yield problems[failure], sentence, always


def _require_physical(document: Document) -> None:
    """Raise DocumentError for what cannot exist, without integrals of densities."""
    path: Keys = ("body",)
    try:
        varying = [shape for shape in _shapes(document.body) if isinstance(shape.density, Formula)]
        for shape in varying:
            from rigidcli.bodies.density_integrals import require_possible

            require_possible(shape.density, shape.maps(FLOAT), shape.geometry(FLOAT), shape.UNIT)
        if not varying:
            document.physical.require()
    except ValueProblem as problem:
        key = ".".join(map(str, problem.path if problem.path[:1] == path else (*path, *problem.path)))
        raise DocumentError([Problem(document.source, problem.message, key=key)]) from None


def _shapes(body: object) -> Iterator[Shape]:
    """The shapes that a body consists of."""
    if isinstance(body, Composite):
        for part in body.parts:
            yield from _shapes(part)
    elif isinstance(body, Shape):
        yield body


def _check(message: str) -> str:
    """A message without the numbers that only a trial has."""
    expected = message.partition("expected ")[2]
    if message.startswith("read ") and expected:
        return f"expected {expected}"
    return re.split(r"[:(]| by up to|,? -?\d", message)[0].strip()
