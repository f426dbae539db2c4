"""The rule of Gauss and Kronrod with 21 nodes, on panels from 0 to 1, and its error.

Source: R. Piessens and others, QUADPACK (Springer, 1983), section 2.2, for the rule and its error; its
estimate is made larger here by what the integrand does at the ends of a panel.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Floats

_KRONROD = (
    (0.9956571630258081, 0.011694638867371874),
    (0.9739065285171717, 0.032558162307964725),
    (0.9301574913557082, 0.054755896574351995),
    (0.8650633666889845, 0.07503967481091996),
    (0.7808177265864169, 0.0931254545836976),
    (0.6794095682990244, 0.10938715880229764),
    (0.5627571346686047, 0.12349197626206584),
    (0.4333953941292472, 0.13470921731147334),
    (0.2943928627014602, 0.14277593857706009),
    (0.14887433898163122, 0.14773910490133849),
    (0.0, 0.1494455540029169),
)
"""The nodes from 0 to 1 of the rule of Kronrod with 21, and their weights. Every other is one of Gauss."""

_END = 1e-9
"""Where an end of a panel is looked at, in units of it: inside, so that it is on the right side of a jump."""

ROUNDING = 4 * float(np.finfo(np.float64).eps)
"""The relative error that rounding leaves in the sum of a panel."""


def interpolating(nodes: Floats, x: Floats) -> Floats:
    """The weights (n by nodes) of values at `nodes` in the polynomial through them at places x (n)."""
    gaps = nodes[:, None] - nodes
    np.fill_diagonal(gaps, 1.0)
    offsets = x[:, None] - nodes
    terms = 1 / (gaps.prod(axis=1) * np.where(offsets == 0, 1e-100, offsets))
    weights: Floats = terms / terms.sum(axis=1, keepdims=True)
    return weights


class Rule(NamedTuple):
    """A rule on panels from 0 to 1, the ends of which are the first and the last of its `places`.

    The weights of both rules are zero there; those of `at_ends` (n by 2) tell how far the polynomial through
    the other values misses those at the ends. Between an end and the next place `unseen` is not seen.
    """

    places: Floats
    kronrod: Floats
    gauss: Floats
    at_ends: Floats
    unseen: float

    @classmethod
    def made(cls, places: Callable[[Floats], Any], slope: Callable[[Floats], Any], end: float) -> Rule:
        """The rule in a variable of which places are a function with this `slope`; `end` is near its ends."""
        positive, weights = np.array(_KRONROD).T
        nodes = (1 + np.concatenate([-positive[:-1], positive[::-1]])) / 2
        kronrod = np.concatenate([weights[:-1], weights[::-1]]) / 2
        gauss = np.zeros(len(nodes))
        gauss[1::2] = np.polynomial.legendre.leggauss(len(nodes) // 2)[1] / 2
        at_ends = np.pad(-interpolating(nodes, np.array([end, 1 - end])).T, ((1, 1), (0, 0)))
        at_ends[0, 0] = at_ends[-1, 1] = 1.0
        both = [np.pad(row * slope(nodes), 1) for row in (kronrod, gauss)]
        at = places(np.concatenate([[end], nodes, [1 - end]]))
        return cls(at, both[0], both[1], at_ends, float(at[1]) / 2)


PLAIN = Rule.made(lambda x: x, lambda x: 1 + 0 * x, _END)
"""The rule of Gauss and Kronrod as it is."""

GRADED = Rule.made(lambda x: x * x * (3 - 2 * x), lambda x: 6 * x * (1 - x), (_END / 3) ** 0.5)
"""The same in a variable in which roots of the distance from either end are smooth."""


def worked_out(values: Floats, inner: Floats, width: Floats, rule: Rule) -> tuple[Floats, Floats, Floats]:
    """Integrals (k by n) over panels of these widths (n), from values at places of the rule (k by n by m)
    with these errors (n by m).

    With them come the errors (n) of the rule, and those that rounding leaves.
    """
    kronrod = width * (values @ rule.kronrod)
    raw = np.abs(kronrod - width * (values @ rule.gauss))
    spread = width * (np.abs(values - (kronrod / width)[..., None]) @ rule.kronrod)
    with np.errstate(invalid="ignore", divide="ignore"):
        own = np.where(spread > 0, spread * np.minimum(1, (200 * raw / spread) ** 1.5), raw)
    missed = np.maximum(np.abs(values @ rule.at_ends) - inner[:, [0, -1]], 0.0)
    own += rule.unseen * width * missed.max(axis=-1)
    rounding = ROUNDING * width * (np.abs(values) @ rule.kronrod)
    return kronrod, own.max(axis=0), rounding.max(axis=0)
