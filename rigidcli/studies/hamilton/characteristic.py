"""The working of linear motion: its matrices, the characteristic polynomial, and the vectors of modes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, cast

import numpy as np

from rigidcli.algebra.arithmetic import EXACT
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, symbol
from rigidcli.algebra.matrices import Matrix, short_determinant
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.core.arithmetic import FLOAT
from rigidcli.document.document import Document
from rigidcli.errors import ExpressionError
from rigidcli.language.tree import Name
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.report import Field, Step, Table
from rigidcli.studies.hamilton.findings import as_typed
from rigidcli.studies.hamilton.linear_equations import MOST_COLUMNS
from rigidcli.studies.hamilton.oscillations import Oscillations
from rigidcli.studies.hamilton.system import known_values
from rigidcli.studies.steps.axes import reduced, solution
from rigidcli.studies.steps.writing import formula, free_name, power, product, total

LONGEST = 300
"""The longest polynomial that is shown, in characters: a longer one teaches nothing."""


def of_matrix(matrix: Sequence[Sequence[Expr]], document: Document) -> list[Field]:
    """Show det(A - lambda 1), where people are shown the matrix A and it does not change with the time."""
    names = {name for row in matrix for e in row for name in e.names}
    if len(matrix) > MOST_COLUMNS or TIME in names:
        return []
    unknown = free_name(("lambda", "Lambda"), frozenset(names))
    x = symbol(unknown)
    shifted = [[e - x if i == j else e for j, e in enumerate(row)] for i, row in enumerate(matrix)]
    head = rf"\det(\mathbf{{A}} - \{unknown}\mathbf{{1}})"
    return list(_polynomial(shifted, unknown, document, f"det(A - {unknown} 1)", head))


def of_oscillations(
    oscillations: Oscillations, document: Document, place: Sequence[Field], modes: Sequence[Table]
) -> Iterator[Step]:
    """Show the linear equations about an equilibrium, the polynomial of the rates, and the mode vectors."""
    motion = oscillations.motion
    names = frozenset(name for e in motion.entries for name in e.names)
    is_free, is_small = not any(e for row in motion.rates for e in row), len(motion.masses) <= MOST_COLUMNS
    unknown = free_name(("omega", "Omega") if is_free else ("s", "S", "sigma"), names)
    x, named = symbol(unknown), dict(zip("MCK", motion.parts, strict=True))
    if is_free:
        named.pop("C")
        equations, matrix = "M y'' + K y = 0", motion.pencil(ZERO, -(x**2))
        way = "At the rate of a mode this determinant vanishes; where its square is negative, motion grows."
        title = f"det(K - {unknown}^2 M)"
        head = rf"\det(\mathbf{{K}} - \{unknown}^2\,\mathbf{{M}})"
    else:
        equations, matrix = "M y'' + C y' + K y = 0", motion.pencil(x, x**2)
        way = f"For y = Re(v exp({unknown} t)) this determinant vanishes; a root with Re {unknown} > 0 grows."
        title = f"det(M {unknown}^2 + C {unknown} + K)"
        head = rf"\det(\mathbf{{M}} {unknown}^2 + \mathbf{{C}} {unknown} + \mathbf{{K}})"
    fields = [_matrix(name, part, document) for name, part in named.items()] if is_small else []
    fields += _polynomial(matrix, unknown, document, title, head)
    yield Step(
        "Small oscillations",
        f"To first order in the displacement y from the equilibrium, {equations}. {way}",
        (*place, *fields),
        tuple(modes),
    )
    if is_free and is_small:
        yield from _vectors(oscillations, document, unknown)


def _vectors(oscillations: Oscillations, document: Document, unknown: str) -> Iterator[Step]:
    """Show the equations (K - omega^2 M) v = 0 at each rate, and the vectors that solve them."""
    motion, names, number = oscillations.motion, list(oscillations.place), 1
    known = known_values(document)
    for root in oscillations.roots or ():
        n = EXACT if isinstance(root.rate, Expr) else FLOAT
        motion = motion if n.exact else motion.changed(lambda e: substitute(e, known))
        masses, stiffness = (n.array(part) for part in (motion.masses, motion.stiffness))
        square = cast(Any, root.angular) ** 2 - cast(Any, root.growth) ** 2
        matrix = n.tidy(stiffness - square * masses)
        head = f"K - {unknown}^2 M"
        fields = [
            Field("", square, f"{unknown}^2", rf"\{unknown}^2"),
            Field("", matrix, head, rf"\mathbf{{K}} - \{unknown}^2\,\mathbf{{M}}"),
        ]
        echelon = reduced(matrix, len(matrix) - len(root.vectors), n)
        fields += [] if echelon is None else solution(*echelon, names, n)
        vectors = [n.array([x for x, _ in vector]) for vector in root.vectors]
        fields += [Field("", vector, "v", r"\mathbf{v}") for vector in vectors]
        last = number + len(vectors) - 1
        yield Step(
            f"Vector of mode {number}" if last == number else f"Vectors of modes {number} to {last}",
            f"At the rate of the mode, ({head}) v = 0 tells the ratios of the components of v; where several "
            "modes have this rate, any solutions that are independent serve.",
            tuple(fields),
        )
        number = last + 1


def _is_numeric(entries: Sequence[Expr], document: Document) -> bool:
    return not document.exact_results and not any(e.names or e.unknown for e in entries)


def _matrix(name: str, matrix: Matrix, document: Document) -> Field:
    entries = [e for row in matrix for e in row]
    kind = float if _is_numeric(entries, document) else object
    entry = Field("", np.array(matrix, dtype=kind), name, rf"\mathbf{{{name}}}")
    return as_typed([entry], document)[0]


def _polynomial(matrix: Matrix, unknown: str, document: Document, title: str, head: str) -> Iterator[Field]:
    """Write the determinant as a polynomial in one name."""
    try:
        determinant = tidy(short_determinant(matrix))
        by_degree = coefficients(determinant, [unknown])
    except ExpressionError:
        return
    if by_degree is None:
        return
    x, values = Name(unknown), {k: tidy(e) for (k,), e in sorted(by_degree.items(), reverse=True)}
    n = FLOAT if _is_numeric(list(values.values()), document) else EXACT
    if n.exact and len(str(determinant)) > LONGEST:
        return
    (styled,) = as_typed([Field("", list(values.values()))], document)
    by_power = zip(values, styled.value, strict=True)
    polynomial = total([product(n, e if n.exact else float(e), power(x, k)) for k, e in by_power])
    yield Field("", formula(polynomial, n), title, head)
