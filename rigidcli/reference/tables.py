"""Pages on units, functions, results, mistakes, files and exit codes, each made of its own table."""

from __future__ import annotations

from rigidcli.errors import EXIT_CODES, ValueProblem
from rigidcli.reference.page import page, paragraph, rows
from rigidcli.report import Field
from rigidcli.studies.results import RESULTS


def exit_codes() -> str:
    """The page of the exit codes."""
    return page("exit-codes", rows([(str(code), meaning) for code, meaning in EXIT_CODES.items()]))


def units() -> str:
    """The page of all units, by what they measure."""
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


def unit(name: str) -> list[str]:
    """The page of a unit; none of another name."""
    from rigidcli.fields.units import TABLE, parse_unit

    try:
        parsed = parse_unit(name)
    except ValueProblem:
        return []
    dimension = str(parsed.dimension)
    facts = [("measures", dimension)]
    facts += [("is", f"{parsed.scale:.12g} {dimension.partition('(')[2].rstrip(')') or dimension}")]
    facts += [("names", names) for names, *_ in TABLE if name in names.split() and names != name][:1]
    return [page(name, rows(facts))]


def functions() -> str:
    """The page of the functions and constants of expressions."""
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


def mistakes() -> str:
    """The page of the codes of findings, each with its sentence."""
    from rigidcli.check.base import CODES

    return page("mistakes", rows([*CODES.items()]))


def mistake(name: str) -> list[str]:
    """The page of a finding of `check`; none of another name."""
    from rigidcli.check.base import CODES

    return [page(f"{name}: a finding of `check`", paragraph(CODES[name]))] if name in CODES else []


def files() -> str:
    """The page of the kinds of FILES."""
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


def results() -> str:
    """The page of the results of every command that computes."""
    commands = [(name, ", ".join(field.key for field in fields)) for name, fields in RESULTS.items()]
    common = "In json, all have `schema`, `name`, `source` and `units`, too, and with `--sweep` also `swept`."
    return page("results of each command", rows(commands), paragraph(common))


def result_rows(command: str, below: str = "") -> str:
    """The results of a command whose keys begin with `below`, with their meanings and units."""
    lines = []
    for field in RESULTS[command]:
        words = "; ".join(filter(None, [field.title.strip(), field.means]))
        words = words or f"the {field.key.rpartition('.')[2].replace('_', ' ')}"
        lines.append((field.key, f"{words} ({field.unit})" if field.unit else words))
    return rows([line for line in lines if line[0].startswith(below)])


def results_called(name: str) -> list[str]:
    """The pages of results of a name; of one that several commands have alike a single page."""
    alike: dict[str, tuple[Field, list[str]]] = {}
    for command, fields in RESULTS.items():
        for field in fields:
            if name in (field.key, field.key.rpartition(".")[2], *field.cells):
                _, places = alike.setdefault(repr(field), (field, []))
                places.append(f"{command}.{field.key}")
    return [result(", ".join(places), field) for field, places in alike.values()]


def result(head: str, field: Field) -> str:
    """The page of a result."""
    facts = {
        "is": field.title.strip(),
        "means": field.means,
        "symbol": field.symbol and f"{field.symbol} (LaTeX)",
        "unit": field.unit or "none",
        "csv": ", ".join(field.cells),
    }
    return page(head, rows([fact for fact in facts.items() if fact[1]]))
