"""Named mistakes: the one table of what each makes of a key.

A mistake is the key of a changed problem: about the centre of mass, with the products of inertia flipped,
with T - V for T + V. An answer that is right by the keys of exactly one mistake is explained by it. To add a
mistake, add an entry here, and its sentence to `codes`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, TypeAlias

from rigidcli.check import motions
from rigidcli.check.kinds import arrays, axes, expression, trajectory

Change: TypeAlias = Callable[[Any], Iterator[Any]]
"""The keys that a mistake makes of a key of one kind."""


def _of_tensor(code: str) -> dict[str, Change]:
    """A mistake on the way to an inertia tensor, which its moments and axes show as well."""
    entries = arrays.worked_out(code)
    return {"tensor": entries, "moments": entries, "axes": axes.worked_out(code)}


MISTAKES: Mapping[str, Mapping[str, Change]] = {
    "sign_error": {"expression": expression.negative, "equations": motions.signs},
    "components_permuted": {
        "vector": arrays.worked_out("components_permuted"),
        "tensor": arrays.worked_out("components_permuted"),
        "axes": axes.worked_out("components_permuted"),
        "trajectory": trajectory.exchanged,
    },
    "transposed": {"matrix": arrays.transposed, "axes": axes.in_columns},
    "products_of_inertia_sign": _of_tensor("products_of_inertia_sign"),
    "products_of_inertia_missing": _of_tensor("products_of_inertia_missing"),
    "parallel_axis_missing": _of_tensor("parallel_axis_missing"),
    "parallel_axis_sign": _of_tensor("parallel_axis_sign"),
    "other_frame": {
        "vector": arrays.worked_out("other_frame"),
        "tensor": arrays.worked_out("other_frame"),
        "axes": axes.worked_out("other_frame"),
    },
    "potential_sign": {"expression": expression.potential_sign, "equations": motions.potential_sign},
    "lagrangian_or_potential_sign": {"expression": expression.other_energy},
    "kinetic_factor": {"expression": expression.kinetic_factor},
    "hamilton_sign": {"equations": motions.hamilton_sign},
    "euler_sign": {"equations": motions.euler_sign},
}
"""What each mistake makes of the keys of each kind."""


def changed(kind: str, key: Any) -> Iterator[tuple[str, Any]]:
    """The codes of mistakes, with the keys that they make of this one."""
    for code, changes in MISTAKES.items():
        if kind in changes:
            yield from ((code, other) for other in changes[kind](key))
