"""Makes the files of a benchmark in the present folder: `python make.py KIND NUMBER`.

It runs in a process of its own, as the peak of memory of a process is passed on to those that it starts.
"""

import random
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

CONFIGS = Path(__file__).parents[2] / "configs"


def documents(number: int) -> None:
    """So many cubes, and the list of their files."""
    names = [f"{k}.yaml" for k in range(1, number + 1)]
    for k, name in enumerate(names, start=1):
        text = f"name: cube {k}\nbody: {{shape: cube, side: 1.{k}, mass: 12, anchor: corner}}\n"
        Path(name).write_text(text)
    Path("files.txt").write_text("\n".join(names) + "\n")


def points(number: int) -> None:
    """So many point masses."""
    np.save("cloud.npy", np.random.default_rng(1).random((number, 4)))
    Path("cloud.yaml").write_text("body: {points: cloud.npy}\n")


def ball(turns: int) -> None:
    """A unit ball of 2 turns (turns + 1) triangles from pole to pole, as binary STL."""
    theta, phi = np.linspace(0, np.pi, turns + 3), 2 * np.pi * np.arange(turns) / turns
    radius = np.sin(theta)
    radius[[0, -1]] = 0
    x, y = radius[:, None] * np.cos(phi), radius[:, None] * np.sin(phi)
    grid = np.stack([x, y, np.cos(theta)[:, None] * np.ones(turns)], axis=2)
    a, b = grid[:-1], grid[1:]
    c, d = np.roll(b, -1, axis=1), np.roll(a, -1, axis=1)
    corners = np.concatenate([np.stack([a, b, c], 2)[:-1], np.stack([a, c, d], 2)[1:]]).reshape(-1, 3, 3)
    facets = np.zeros(len(corners), [("normal", "<f4", 3), ("vertices", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["vertices"] = corners
    Path("ball.stl").write_bytes(b"ball".ljust(80) + len(facets).to_bytes(4, "little") + facets.tobytes())
    Path("ball.yaml").write_text("body: {mesh: ball.stl, density: 1000}\n")


def free(duration: int) -> None:
    """A free body that turns once a second, with ten samples of each turn."""
    Path("motion.yaml").write_text(
        "parameters: {w: 2*pi/sqrt(1.15)}\nbody: {moments: [1, 2, 2.5]}\nabout: com\n"
        f"motion: {{omega: [0.3*w, 0.5*w, 0.9*w], duration: {duration}, samples: {10 * duration + 1}}}\n"
    )


def heavy(duration: int) -> None:
    """A symmetric top under its weight, with ten samples a second."""
    Path("top.yaml").write_text(
        "body: {moments: [2, 2, 1], mass: 1, com: [0, 0, 0.5], given_about: origin}\n"
        "motion:\n  omega: [0.4, 0.3, 6]\n  orientation: {axis: [1, 0, 0], angle: 60 deg}\n"
        f"  torque: {{gravity: 9.81}}\n  duration: {duration}\n  samples: {10 * duration + 1}\n"
    )


def starts(number: int) -> None:
    """So many starts of a free body."""
    omegas = np.random.default_rng(1).normal(size=(number, 3))
    np.savetxt("starts.csv", omegas, delimiter=",", header="w1,w2,w3", comments="", fmt="%.17g")
    Path("ensemble.yaml").write_text(
        "body: {moments: [1, 2, 3]}\nabout: com\nmotion: {omega: starts.csv, duration: 100, samples: 100}\n"
    )


def swarm(number: int) -> None:
    """So many pendulums, some of which turn over."""
    source = np.random.default_rng(3)
    starts = source.uniform([-3, -1], [3, 1], (number, 2))
    np.savetxt("swarm.csv", starts, delimiter=",", header="x,p_x", comments="", fmt="%.6f")
    system = "system: {coordinates: [x], kinetic: xdot**2/2, potential: -cos(x)}"
    Path("swarm.yaml").write_text(f"{system}\norbit: {{initial: swarm.csv, duration: 20, samples: 5}}\n")


def pendulum(duration: int) -> None:
    """A double pendulum, and the orbit of a regular swing of it, with ten samples a second."""
    system = """\
system:
  coordinates: [a, b]
  kinetic: (m1 + m2)*l1**2*adot**2/2 + m2*l2**2*bdot**2/2 + m2*l1*l2*adot*bdot*cos(a - b)
  potential: -(m1 + m2)*g*l1*cos(a) - m2*g*l2*cos(b)
parameters: {m1: 1, m2: 0.6, l1: 1, l2: 0.7, g: 9.81}
"""
    orbit = f"initial: {{a: 0.8, b: 0.4, p_a: 0, p_b: 0}}, duration: {duration}, samples: {10 * duration + 1}"
    Path("pendulum.yaml").write_text(system)
    Path("orbit.yaml").write_text(f"{system}orbit: {{{orbit}}}\n")


def section(duration: int) -> None:
    """A Poincare section of Henon and Heiles's system, with a crossing about every 6.4 s."""
    system = "coordinates: [x, y], hamiltonian: (p_x**2 + p_y**2 + x**2 + y**2)/2 + x**2*y - y**3/3"
    orbit = f"initial: {{x: 0, y: 0.1, p_x: 0.35, p_y: 0.1}}, duration: {duration}, section: {{at: x}}"
    Path("section.yaml").write_text(f"system: {{{system}}}\norbit: {{{orbit}}}\n")


PENDULUMS = (
    "((m1 + m2)*l1**2*p_theta2**2 + m2*l2**2*p_theta1**2"
    " - 2*m2*l1*l2*p_theta1*p_theta2*cos(theta1 - theta2))"
    "/(2*m2*l1**2*l2**2*(m1 + m2*sin(theta1 - theta2)**2))"
    " - (m1 + m2)*g*l1*cos(theta1) - m2*g*l2*cos(theta2)"
)

ANSWERS = {
    "document: three_masses.yaml, ask: inertia.tensor": (
        "[[10, 0, 0], [0, 6, 1], [0, 1, 6]]",
        "[[10, 0, 0], [0, 6, -1], [0, -1, 6]]",
    ),
    "document: three_masses.yaml, ask: axes, normalized: optional": (
        "[{moment: 5, axis: [0, 1, -1]}, {moment: 7, axis: [0, 1, 1]}, {moment: 10, axis: [1, 0, 0]}]",
        "[{moment: 7, axis: [0, 1, -1]}, {moment: 5, axis: [0, 1, 1]}, {moment: 10, axis: [1, 0, 0]}]",
    ),
    "document: cone_top.yaml, ask: precess.top.gyroscopic_rate": ("20.8 rad/s", "20.8 rpm"),
    "document: taylor_13_02.yaml, ask: hamilton.hamiltonian": (
        "p_x**2/(2*m) - m*g*x",
        "p_x**2/(2*m) + m*g*x",
    ),
    "document: double_pendulum.yaml, ask: hamilton.hamiltonian": (
        PENDULUMS,
        "p_theta1**2/(2*m1*l1**2) - m1*g*l1*cos(theta1)",
    ),
    "document: notes_spring.yaml, ask: hamilton.equations": (
        "{xdot: p_x/m, p_xdot: -k*x}",
        "[m*xddot = k*x]",
    ),
}
"""Questions, each with an answer that is right and one that is wrong."""


def classroom(number: int) -> None:
    """An assignment, and the answers of a class of so many, of which about a fifth is wrong."""
    chance = random.Random(1)
    questions = [f"  q{k}: {{{text}}}\n" for k, text in enumerate(ANSWERS)]
    text = "questions:\n" + "".join(questions).replace("document: ", f"document: {CONFIGS}/")
    Path("assignment.yaml").write_text(text)
    Path("answers").mkdir()
    for student in range(number):
        lines = [f"  q{k}: {texts[chance.random() < 0.2]}\n" for k, texts in enumerate(ANSWERS.values())]
        Path(f"answers/student{student:05}.yaml").write_text("answers:\n" + "".join(lines))


KINDS: dict[str, Callable[[int], None]] = {
    make.__name__: make
    for make in (documents, points, ball, free, heavy, starts, swarm, pendulum, section, classroom)
}

if __name__ == "__main__":
    KINDS[sys.argv[1]](int(sys.argv[2]))
