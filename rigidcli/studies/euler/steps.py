"""The working of `euler`: Euler's equations with the numbers of the body, and what follows from them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from rigidcli.core.arithmetic import FLOAT
from rigidcli.core.free_body import circulation
from rigidcli.core.principal import PrincipalFrame
from rigidcli.document.motion import SpaceTorque
from rigidcli.language.text import reading
from rigidcli.language.tree import Name, Node, bound, number
from rigidcli.report import NOISE, Field, Step
from rigidcli.studies.euler.motion import InitialValueProblem, Trajectory
from rigidcli.studies.writing import filled, product, total


def _about_axes(frame: PrincipalFrame) -> str:
    """The consequence of the equation of a small component for the axes of a body."""
    if len(frame.groups) == 3:
        return "It oscillates about the axes of the least and of the greatest moment, and grows between them."
    alone = " It oscillates about the symmetry axis." if len(frame.groups) == 2 else ""
    return f"About axes of equal moments the coefficient is zero: they are neutral.{alone}"


# Characters of a component of the torque that is written into its equation: more hide the other terms.
LONGEST_TORQUE = 80


def _torque(problem: InitialValueProblem) -> tuple[list[Node], str]:
    """N along e1, e2, e3, where w1, w2, w3 are along these, too, and the meaning of its other letters."""
    axes = problem.shown @ problem.frame.axes.T
    axes = np.where(np.abs(axes) < NOISE, 0.0, axes)
    arm, words = axes.T @ problem.weight, ""
    terms: list[list[Node]] = [[], [], []]
    if problem.weight.any():
        words = " N is that of the weight, where u1, u2, u3 are components of the unit vector upward."
        for k, terms_along in enumerate(terms):
            i, j = (k + 1) % 3, (k + 2) % 3
            terms_along += _combined((arm[j], -arm[i]), (Name(f"u{i + 1}"), Name(f"u{j + 1}")))
    own = problem.torque
    if own is None:
        return [total(along) for along in terms], words
    rates = [Name(f"w{k}") for k in (1, 2, 3)]
    meanings = {f"w{i + 1}": total(_combined(axes[i], rates)) for i in range(3)}
    formulas = [(f.expression.root, {k: number(v) for k, v in f.constants.items()}) for f in own.components]
    given = [bound(root, constants | meanings) for root, constants in formulas]
    parts = [_combined(axes[:, k], given) for k in range(3)]
    in_space = isinstance(own, SpaceTorque)
    if in_space or any(len(reading(total(part))) > LONGEST_TORQUE for part in parts):
        listed = ", ".join(reading(bound(root, constants)) for root, constants in formulas)
        words += f" N1, N2, N3 are the components along e1, e2, e3 of the torque ({listed}),"
        words += " which is given by "
        words += "components in space." if in_space else "components along x, y, z, like w1, w2, w3 in it."
        parts = [[Name(f"N{k}")] for k in (1, 2, 3)]
    return [total([*along, *part]) for along, part in zip(terms, parts, strict=True)], words


def _combined(numbers: Iterable[float], nodes: Iterable[Node]) -> list[Node]:
    """The products of numbers and formulas that are not zero."""
    pairs = zip(numbers, nodes, strict=True)
    return [product(FLOAT, float(x), node) for x, node in pairs if x and reading(node) not in ("0", "0.0")]


def steps(motion: Trajectory, fields: Sequence[Field]) -> Iterator[Step]:
    """The way to the motion, along e1, e2, e3, shown by the results themselves."""
    frame, free = motion.problem.frame, motion.free
    numbers = {f"lambda{k + 1}": float(moment) for k, moment in enumerate(frame.moments)}
    torque, acting = _torque(motion.problem)
    around = ((1, 2, 3), (2, 3, 1), (3, 1, 2))
    equations = (
        filled(f"(lambda{i} - lambda{j})*w{i}*w{j}", FLOAT, f"lambda{k} dw{k}/dt", torque[k - 1], **numbers)
        for k, i, j in around
    )
    yield Step(
        "Euler's equations",
        "Seen from the body, dL/dt + omega x L = N. Along e1, e2, e3, where L_k = lambda_k w_k, this is "
        f"lambda1 dw1/dt = (lambda2 - lambda3) w2 w3 + N1, and so on around.{acting}",
        (
            Field("", frame.moments, "principal moments", r"\lambda_{1,2,3}", "kg m^2", counts=True),
            Field("", frame.axes, "e1, e2, e3 (rows)", r"\mathbf{e}_{1,2,3}"),
            *equations,
        ),
    )
    if motion.problem.weight.any():
        return
    yield Step(
        "Stability",
        "Near a rotation w about axis i, a small component x along another obeys x'' = -w^2 (lambda_i - "
        "lambda_j) (lambda_i - lambda_k)/(lambda_j lambda_k) x. " + _about_axes(frame),
        tuple(
            filled(
                f"-w^2*x*(lambda{i} - lambda{j})*(lambda{i} - lambda{k})/(lambda{j}*lambda{k})",
                FLOAT,
                f"x'' about e{i}",
                **numbers,
            )
            for i, j, k in around
            if all(numbers.values())
        ),
    )
    if free is None:
        return
    results = {entry.key: replace(entry, key="") for entry in fields}
    shown = [results["angular_momentum"], results["kinetic_energy"]]
    sentence = f"No torque acts: L in space and T are constant. Kind of motion: {results['motion'].words}."
    given = motion.problem.tensor, motion.problem.omega
    if free.regime.startswith("about"):
        path = circulation(*given)
        sentence += " The components of omega are Jacobi's elliptic functions cn, sn and dn of the modulus k."
        shown += [
            Field("", float(path.k[0, 0]) ** 2, "k^2", "k^2"),
            Field("", float(path.rate[0, 0]), "rate of their argument", "", "rad/s"),
            Field("", np.abs(path.amplitudes[0, 0]), "amplitudes", "", "rad/s"),
            results["period"],
        ]
    yield Step("Motion", sentence, tuple(shown))
