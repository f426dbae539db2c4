"""The working of `axes`: the characteristic polynomial, its roots and axes, and L, T and N at omega."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import Arithmetic, Array, Scalar, echelon
from rigidcli.core.principal import PrincipalFrame
from rigidcli.document.document import Document
from rigidcli.language.text import latex_name, reading
from rigidcli.language.tree import Name, Node, Number, Product, Reciprocal
from rigidcli.report import NOISE, Field, Step
from rigidcli.studies.inertia import steps as inertia
from rigidcli.studies.writing import formula, free_name, power, product, total

# The most characters of an entry in a matrix whose elimination is shown: longer entries hide the method.
LONGEST_ENTRY = 40


def steps(document: Document, frame: PrincipalFrame | None, fields: Sequence[Field]) -> Iterator[Step]:
    """The way to the tensor, from it to its principal frame, and to L and T at an omega."""
    n, results = document.arithmetic, {entry.key: replace(entry, key="") for entry in fields}
    tensor = results["tensor"].value
    yield from inertia.steps(document, tensor)
    yield from _frame_steps(tensor, frame, n, frozenset(document.parameters or ()))
    if "omega" in results:
        yield _motion_step(tensor, results, n)


def _frame_steps(
    tensor: Array, frame: PrincipalFrame | None, n: Arithmetic, names: frozenset[str]
) -> Iterator[Step]:
    factor, rest = _common_factor(tensor, n)
    mu = None if factor is None else free_name(("mu", "nu", "kappa"), names)
    yield _polynomial(rest, factor, mu, frame, n, free_name(("lambda", "Lambda"), names))
    if frame is None:
        return
    if len(frame.groups) == 1:
        sentence = "All moments are equal, so that every axis through O is a principal axis."
        yield Step("Principal axes", sentence, (Field("", frame.axes, "e1, e2, e3 (rows)"),))
    else:
        for group in frame.groups:
            yield _axis(rest, factor, frame, group, n)


def _motion_step(tensor: Array, results: Mapping[str, Field], n: Arithmetic) -> Step:
    """L, T and the torque at a given omega, component by component."""
    omega, momentum = (results[key].value for key in ("omega", "angular_momentum"))
    shown: list[Field] = []
    if not n.exact:
        tensor, omega, momentum = (
            np.where(np.abs(part) < NOISE * np.abs(part).max(), 0.0, part)
            for part in (tensor, omega, momentum)
        )

    def worked(title: str, left: Sequence[Scalar], right: Sequence[Scalar], half: bool = False) -> None:
        """Show a sum of products, with numbers in place of letters, if it is no longer than a line."""
        pairs = [(a, b) for a, b in zip(left, right, strict=True) if a != 0 and b != 0]
        terms = [product(n, a, product(n, b)) for a, b in pairs]
        whole = total(terms)
        if half:
            whole = Product((whole, Reciprocal(Number("2", 2))))
        if len(reading(whole)) <= 2 * LONGEST_ENTRY:
            shown.append(Field("", formula(whole, n), title, "_".join(title)))

    for k, axis in enumerate("xyz"):
        worked(f"L{axis}", tensor[k], omega)
    shown.append(results["angular_momentum"])
    worked("T", omega, momentum, half=True)
    shown.append(results["kinetic_energy"])
    sentence, torque = "L = I omega, and T = omega.L/2.", results["holding_torque"]
    if torque.value is not None and any(entry != 0 for entry in torque.value):
        sentence += " While omega stays, L turns with the body, which takes the torque N = omega x L."
        for k, axis in enumerate("xyz"):
            i, j = (k + 1) % 3, (k + 2) % 3
            worked(f"N{axis}", (omega[i], -omega[j]), (momentum[j], momentum[i]))
        shown.append(torque)
    return Step("Turning at this angular velocity", sentence, tuple(shown))


def _common_factor(tensor: Array, n: Arithmetic) -> tuple[Any, Array]:
    """A factor with symbols and the numbers that remain; or None and the tensor, without such a factor."""
    if n.exact:
        from rigidcli.algebra.arithmetic import common_factor

        factor, rest = common_factor(tensor)
        if factor.names and not any(entry.names for entry in rest.flat):
            return factor, rest
    return None, tensor


def _polynomial(
    rest: Array,
    factor: Scalar | None,
    mu: str | None,
    frame: PrincipalFrame | None,
    n: Arithmetic,
    unknown: str,
) -> Step:
    x, unit = Name(unknown), None if mu is None else Name(mu)
    minors = sum(rest[i, i] * rest[j, j] - rest[i, j] ** 2 for i, j in ((0, 1), (1, 2), (2, 0)))
    traces = n.tidy(n.array([rest.trace(), -minors, rest[0] @ np.cross(rest[1], rest[2])]))
    terms: list[Node] = [product(n, -1, power(x, 3))]
    for place, coefficient in enumerate(traces, 1):
        if coefficient != 0:
            terms.append(product(n, coefficient, power(unit, place), power(x, 3 - place)))
    fields = []
    if factor is not None:
        fields.append(Field("", factor, f"with {mu}", rf"\{mu}"))
    head, symbol = f"det(I - {unknown} 1)", rf"\det(\mathbf{{I}} - \{unknown.lower()}\mathbf{{1}})"
    fields.append(Field("", formula(total(terms), n), head, symbol))
    if frame is not None:
        ratios = frame.moments if factor is None else n.tidy(frame.moments / factor)
        parts = [
            power(total([product(n, ratios[group[0]], unit), product(n, -1, x)]), len(group))
            for group in frame.groups
        ]
        fields.append(Field("", formula(product(n, 1, *parts), n), "in factors", ""))
        for group in frame.groups:
            name = " = ".join(f"lambda{k + 1}" for k in group)
            latex = " = ".join(rf"\lambda_{{{k + 1}}}" for k in group)
            fields.append(Field("", frame.moments[group[0]], name, latex, "kg m^2"))
    return Step(
        "Principal moments",
        f"The equation (I - {unknown} 1) e = 0 has a solution e other than zero only where the determinant "
        f"of I - {unknown} 1 vanishes. The roots of this polynomial are the principal moments.",
        tuple(fields),
    )


def _axis(
    rest: Array, factor: Scalar | None, frame: PrincipalFrame, group: Sequence[int], n: Arithmetic
) -> Step:
    moment = frame.moments[group[0]] if factor is None else n.tidy(frame.moments / factor)[group[0]]
    singular = n.tidy(rest - moment * n.array(np.eye(3, dtype=int)))
    shown = singular if factor is None else n.tidy(factor * singular)
    fields = [Field("", shown, "I - lambda 1", r"\mathbf{I} - \lambda\mathbf{1}", "kg m^2")]
    sentence = ""
    if (rows := reduced(singular, 3 - len(group), n)) is not None:
        matrix, pivots = rows
        fields.append(Field("", matrix, "row echelon form", r"\text{row echelon form}"))
        fields += solution(matrix, pivots, "xyz", n)
        free = ["xyz"[k] for k in range(3) if k not in pivots]
        sentence = f"The free {'variable is' if len(free) == 1 else 'variables are'} {' and '.join(free)}. "
    fields += [Field("", frame.axes[k], f"e{k + 1}", rf"\mathbf{{e}}_{{{k + 1}}}") for k in group]
    title, last = "Axis", "The solution of length one is"
    if len(group) == 2:
        title = "Axes"
        last = "The root is double: any two orthogonal vectors of length one in this plane serve, such as"
    roots = " = ".join(f"lambda{k + 1}" for k in group)
    names = " and ".join(f"e{k + 1}" for k in group)
    return Step(f"{title} of {roots}", f"{sentence}{last} {names}.", tuple(fields))


def reduced(matrix: Array, rank: int, n: Arithmetic) -> tuple[Array, list[int]] | None:
    """The reduced row echelon form and the pivot columns; None where the entries are too long to show."""
    if n.exact and max(len(str(entry)) for entry in matrix.flat) > LONGEST_ENTRY:
        return None
    # Rounding of floats leaves less than this of a zero.
    rows, pivots = echelon(matrix, rank, 0.0 if n.exact else 1e-9 * np.abs(matrix).max(), n)
    if len(pivots) < rank or (n.exact and max(len(str(entry)) for entry in rows.flat) > LONGEST_ENTRY):
        return None
    rows[rank:] = 0 * rows[rank:]
    return n.tidy(rows + 0), pivots


def solution(matrix: Array, pivots: Sequence[int], names: Sequence[str], n: Arithmetic) -> Iterator[Field]:
    """The variables that are not free by the rows of the echelon form."""
    for row, pivot in enumerate(pivots):
        right = [
            product(n, -matrix[row, k], Name(names[k]))
            for k in range(len(matrix))
            if k not in pivots and matrix[row, k] != 0
        ]
        yield Field("", formula(total(right), n), names[pivot], latex_name(names[pivot]))
