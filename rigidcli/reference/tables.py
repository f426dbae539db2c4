"""Units, functions, results, mistakes and exit codes, each from its own table."""

from __future__ import annotations

from rigidcli.errors import EXIT_CODES
from rigidcli.reference.page import page, paragraph, rows
from rigidcli.report import Field


def exit_codes() -> str:
    """What the exit codes mean."""
    return page("exit-codes", rows([(str(code), means) for code, means in EXIT_CODES.items()]))


def units() -> str:
    """All units, by what they measure."""
    from rigidcli.fields.units import PREFIXES, TABLE, parse_unit

    by_dimension: dict[str, list[str]] = {}
    for names, *_ in TABLE:
        first = names.split()[0]
        by_dimension.setdefault(str(parse_unit(first).dimension), []).append(first)
    prefixes = ", ".join(prefix for prefix in PREFIXES if len(prefix) <= 2 and prefix.isascii())
    return page(
        "units",
        rows([(dimension, ", ".join(names)) for dimension, names in by_dimension.items()], most=32),
        paragraph(
            f"SI units may have a prefix ({prefixes}). Products and powers: `g cm^2`, `kg/m^3`, `N m`."
        ),
    )


def unit(name: str) -> str | None:
    """One unit; None for what is none."""
    from rigidcli.errors import ValueProblem
    from rigidcli.fields.units import TABLE, parse_unit

    try:
        found = parse_unit(name)
    except ValueProblem:
        return None
    names = next((names for names, *_ in TABLE if name in names.split()), name)
    unit = str(found.dimension).partition("(")[2].rstrip(")") or str(found.dimension)
    told = [("measures", str(found.dimension)), ("is", f"{found.scale:.12g} {unit}"), ("names", names)]
    return page(name, rows([row for row in told if row != ("names", name)]))


def functions() -> str:
    """The functions and constants of expressions."""
    from rigidcli.language.functions import ALIASES, CONSTANTS, FUNCTIONS

    listed = [
        (f"{name}({'y, x' if function.arity == 2 else 'x'})", function.says)
        for name, function in FUNCTIONS.items()
    ]
    listed += [(f"{alias}(x)", f"the same as {name}(x)") for alias, name in ALIASES.items()]
    listed += [(name, f"{value:.16g}") for name, value in CONSTANTS.items()]
    return page("functions", rows(listed), "Operators: + - * / and ** or ^ for powers. `2 a` is a product.")


def torque_variable(name: str) -> list[str]:
    """The page of a variable on which a torque may depend; none of another name."""
    from rigidcli.document.motion import VARIABLES

    head = f"{name}: in the components of `motion.torque`"
    return [page(head, paragraph(VARIABLES[name]))] if name in VARIABLES else []


def mistakes() -> dict[str, str]:
    """The codes of findings, each with its sentence."""
    from rigidcli.check.base import CODES

    return CODES


def files() -> str:
    """The kinds of FILES."""
    from rigidcli.bodies.robots import ENDINGS
    from rigidcli.document.draft import BODY_FILES

    bodies = [
        (", ".join(end for end in BODY_FILES if BODY_FILES[end] == form), f"`body.{form}` by itself")
        for form in dict.fromkeys(BODY_FILES.values())
    ]
    robots = (", ".join(ENDINGS), "a robot, by its root URDF, SDF or MJCF: a result for each link")
    lists = ("@files.txt", "a list of names, one on a line")
    others = ("any other, and -", "a document in YAML or JSON; - is standard input")
    remark = "`--set` completes a body that is a file: `rigidcli axes part.stl --set body.density=7850`."
    return page("files that commands read", rows([*bodies, robots, lists, others]), paragraph(remark))


def results() -> dict[str, tuple[Field, ...]]:
    """The results of every command that computes."""
    from rigidcli.studies.results import RESULTS

    return RESULTS


def result_rows(fields: tuple[Field, ...]) -> str:
    """Results, each with its unit and what it is."""
    return rows([(field.key, _told(field)) for field in fields])


def _told(field: Field) -> str:
    unit = f" ({field.unit})" if field.unit else ""
    what = "; ".join(filter(None, [field.title.strip(), field.means]))
    return f"{what or 'the ' + field.key.rpartition('.')[2].replace('_', ' ')}{unit}"


def results_called(name: str) -> list[str]:
    """The pages of results of a name; of one that several commands have alike a single page."""
    alike: dict[str, tuple[Field, list[str]]] = {}
    for command, fields in results().items():
        for field in fields:
            if name in (field.key, field.key.rpartition(".")[2], *field.cells):
                _, places = alike.setdefault(repr(field), (field, []))
                places.append(f"{command}.{field.key}")
    return [result(", ".join(places), field) for field, places in alike.values()]


def result(head: str, field: Field) -> str:
    """One result."""
    told = [
        ("is", field.title.strip()),
        ("means", field.means),
        ("symbol", field.symbol and f"{field.symbol} (LaTeX)"),
        ("unit", field.unit or "none"),
        ("csv", ", ".join(field.cells)),
    ]
    return page(head, rows([row for row in told if row[1]]))
