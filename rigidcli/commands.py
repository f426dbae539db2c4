"""The commands: a row for each, from which the program, its help and the Python interface are built."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple


class Command(NamedTuple):
    """A command.

    `title`: that of its results.
    `needs`: a document of this study has at least one of these sections.
    `ignored`: sections of its documents that are for other commands.
    `section`: the section of a motion, with the `samples` and `duration` that options set.
    `pictures`: the kinds that it draws, the best first, with the modules of `rigidcli.studies` for them.
    `python`: an example for its help in Python.
    `module`: the module of `rigidcli.cli` with its function, unless it is a study.
    """

    name: str
    help: str = ""
    title: str = ""
    needs: tuple[str, ...] = ()
    ignored: str = ""
    section: str = ""
    pictures: Mapping[str, str] = {}
    python: str = ""
    module: str = ""

    @property
    def has_replay(self) -> bool:
        """Whether its pages may replay a motion."""
        return "top" in self.needs or bool(self.section)

    @property
    def about(self) -> str:
        """What the command does, in a line."""
        return self.help.partition("\n")[0]


_ROWS = (
    Command(
        "inertia",
        """Mass, centre of mass, inertia tensor about a point.

        Example: rigidcli inertia -f csv cube.yaml plate.yaml
        """,
        title="inertia tensor",
        needs=("body",),
        ignored="motion top tide system orbit equilibrium transform observables brackets",
        pictures={"body": "inertia.pictures", "ellipsoid": "inertia.pictures"},
        python="""
        >>> rigidcli.inertia({"body": {"shape": "cube", "side": 1, "mass": 12}})["mass"]
        12.0
        """,
    ),
    Command(
        "axes",
        """Principal moments and axes; motion at a given omega.

        With `motion.omega` also L, T, the angle between omega and L, and whether the body wobbles.

        Example: rigidcli axes cube.yaml --set body.mass=3
        """,
        title="principal moments and axes",
        needs=("body",),
        ignored="top tide system orbit equilibrium transform observables brackets",
        pictures={"body": "inertia.pictures", "ellipsoid": "inertia.pictures"},
        python="""
        >>> rigidcli.axes("body: {shape: cube, side: 1, mass: 12, anchor: corner}")["class"]
        'prolate'
        """,
    ),
    Command(
        "precess",
        """Precession of tops, free bodies and planets.

        A document has a `top`, a `body` with `motion.omega`, a planet with a `tide`, or several of these.

        Example: rigidcli precess top.yaml --set top.spin="900 rpm"
        """,
        title="precession",
        needs=("top", "body", "tide"),
        ignored="system orbit equilibrium transform observables brackets",
        pictures=dict.fromkeys(("trace", "polhode"), "precess.pictures"),
        python="""
        >>> top = {"mass": 0.3, "distance": 0.05, "lambda3": 0.000375, "spin": "20 rps", "gravity": 9.8}
        >>> round(rigidcli.precess({"top": top})["top"]["gyroscopic_rate"], 2)
        3.12
        """,
    ),
    Command(
        "euler",
        """Motion by Euler's equations in time; stability of the axes.

        A motion without torque has a closed form; a driven one is integrated.

        Example: rigidcli euler motion.yaml --duration "5 min" -f csv
        """,
        title="motion by Euler's equations",
        needs=("body", "top"),
        ignored="tide system orbit equilibrium transform observables brackets",
        section="motion",
        pictures=dict.fromkeys(("omega", "polhode", "trace"), "euler.pictures"),
        python="""
        >>> body = {"moments": [1, 2, 3], "mass": 1}
        >>> result = rigidcli.euler({"body": body, "motion": {"omega": [0, 1e-3, 2], "duration": 10}})
        >>> result["motion"]
        'about_highest'
        """,
    ),
    Command(
        "hamilton",
        """From a Lagrangian to H, Hamilton's equations and orbits.

        It may also begin with energies, particles or a Hamiltonian. It finds what is conserved.

        Example: rigidcli hamilton spring.yaml -f latex
        """,
        title="Hamilton's equations",
        needs=("system",),
        ignored="body about axis frame motion top tide",
        section="orbit",
        pictures=dict.fromkeys(
            ("section", "path", "phase", "resonance", "series", "observables"), "hamilton.pictures"
        ),
        python="""
        >>> system = {"coordinates": ["x"], "lagrangian": "m*xdot**2/2 - k*x**2/2"}
        >>> rigidcli.hamilton({"system": system, "parameters": {"m": None, "k": None}})["hamiltonian"]
        p_x**2/(2*m) + k*x**2/2
        """,
    ),
    *(Command(name, module=name) for name in ("check", "validate")),
    *(Command(name, module="printing") for name in ("explain", "schema", "new")),
)

# The commands. A study is the function `run` of the module of its name in `rigidcli.studies`; another one is
# the function of its name in its module of `rigidcli.cli`, where its help stands, too.
COMMANDS = {row.name: row for row in _ROWS}
# The names of the studies, each of which is also a function of the package.
STUDIES = tuple(row.name for row in _ROWS if row.needs)
