"""All that can be explained, one entry each: keys, shapes, units, functions, results and mistakes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any, TypeAlias

from rigidcli.algebra.arithmetic import EXACT
from rigidcli.bodies.robots import ENDINGS
from rigidcli.bodies.shapes import SHAPES
from rigidcli.document.document import Document
from rigidcli.document.draft import BODY_FILES
from rigidcli.document.motion import VARIABLES
from rigidcli.errors import EXIT_CODES
from rigidcli.fields.section import Section
from rigidcli.fields.units import PREFIXES, TABLE, parse_unit
from rigidcli.homework.base import CODES
from rigidcli.homework.question import AnswerFile, Assignment
from rigidcli.language.functions import ALIASES, CONSTANTS, FUNCTIONS
from rigidcli.language.notation import NOTATION, QUANTITIES
from rigidcli.reference.results import Entry, results
from rigidcli.reference.schema import json_schema

Schema: TypeAlias = Mapping[str, Any]
"""The JSON Schema of a value."""


FILES: Mapping[str, tuple[str, type[Section]]] = {
    "document": ("the keys at the top of a document", Document),
    "assignment": ("the keys of an assignment of `check`", Assignment),
    "answers": ("the keys of an answer file", AnswerFile),
}
"""The files that people write."""

CONVENTIONS = {
    "units": "plain numbers are in SI units: kg, m, s, rad",
    "products of inertia": "Ixy = -sum m x y; with `products: plus` the typed tensor has plus sums",
    "moments": "ascending; equal if they differ by less than 1e-12 of the largest",
    "principal axes": "the rows e1, e2, e3: unit vectors, right-handed; e1 and e3 have a positive largest "
    "component, and e2 = e3 x e1; the axes of equal moments are those nearest to x, y, z",
    "kinetic energy": "T = omega.I.omega/2",
    "rotations": "active, from body to space; zxz turns about the moving axes: Rz(phi) Rx(theta) Rz(psi)",
    "quaternions": "scalar first, from body to space",
    "gravity": "9.80665 m/s^2 along -z, unless it is given",
    "body_rate": "(lambda3 - lambda1)/lambda1 omega3; Taylor's Omega_b is its negative",
    "velocities": "the velocity of x is xdot, its momentum p_x, and the time t",
    "conserved energy": "three questions are kept apart. Is H conserved (dH/dt = 0)? Is H = T + V? Are the "
    "coordinates natural, that is, do positions follow from them without the time?",
    "constraints": "f = 0 acts on each coordinate q with the force lambda df/dq: the tension of a pendulum, "
    "which pulls towards smaller r, is a negative multiplier of r - l",
    "brackets": "{x, p_x} = 1",
}
"""The conventions, by what they are about."""

SECTION = {
    "how": "a section is a flat body in x and y with 1 kg on each unit of area: `new section` prints one, of "
    "plates, polygons and holes. With `density: 1 kg/cm^2` and `--units kg,cm,deg`, kg stand for cm^2 and "
    "kg cm^2 for cm^4. `about: com` takes all about the centroid.",
    "A": "area: `mass`",
    "centroid": "`center_of_mass`",
    "I_x, I_y": "second moments of area about x and y: Ixx and Iyy of `tensor`; about another line, "
    "`axis_moment` with an `axis`. The radius of gyration, sqrt(I/A), is `radius_of_gyration`.",
    "I_xy": "product moment, the integral of x y: -Ixy of `tensor`",
    "I_p": "polar moment I_x + I_y: Izz of `tensor`, and the third of `moments`. It is the torsion constant "
    "of round sections only.",
    "I_1, I_2": "principal second moments of area, I_max and I_min (I_u and I_v, or I_z and I_y): the second "
    "and the first of `moments`",
    "theta_p": "principal direction, the angle from x to the strong axis, about which the moment is I_max: "
    "atan2(e2y, e2x) of `axes`; e1 is the weak axis, across it. tan 2 theta_p = -2 I_xy/(I_x - I_y)",
    "W": "section modulus I/c: the moment, divided by the largest distance from the axis",
}
"""What the section of a beam has, by the usual names, and where it stands in the results."""


def entries() -> list[Entry]:
    """All entries; the topics are those with a path of one name."""
    return [*_keys(), *_shapes(), *results(), *_others()]


def _others() -> Iterator[Entry]:
    yield Entry(("files",), "the files that commands read, by the endings of their names")
    for form in dict.fromkeys(BODY_FILES.values()):
        endings = ", ".join(ending for ending in BODY_FILES if BODY_FILES[ending] == form)
        yield Entry(("files", endings), f"`body.{form}` by itself, which `--set body.density=7850` completes")
    yield Entry(("files", ", ".join(ENDINGS)), "a robot in URDF, SDF or MJCF: a result for each link")
    yield Entry(("files", "@files.txt"), "a list of names, one on a line")
    yield Entry(("files", "any other, and -"), "a document in YAML or JSON; - is standard input")
    prefixes = ", ".join(prefix for prefix in PREFIXES if len(prefix) <= 2 and prefix.isascii())
    remark = f"SI units may have a prefix ({prefixes}). Products and powers: `g cm^2`, `kg/m^3`, `N m`."
    yield Entry(("units",), "units of quantities such as `5 cm`", facts={"prefixes": remark})
    by_dimension: dict[str, list[str]] = {}
    for names, *_ in TABLE:
        first = names.split()[0]
        by_dimension.setdefault(str(parse_unit(first).dimension), []).append(first)
    for dimension, units in by_dimension.items():
        yield Entry(("units", dimension), ", ".join(units))
    operators = "+ - * / and ** or ^ for powers. `2 a` is a product."
    yield Entry(("functions",), "functions in expressions", facts={"operators": operators})
    for name, function in FUNCTIONS.items():
        call = f"{name}({'y, x' if function.arity == 2 else 'x'})"
        yield Entry(("functions", call), function.says, other_names=[name])
    for alias, name in ALIASES.items():
        yield Entry(("functions", f"{alias}(x)"), f"the same as {name}(x)", other_names=[alias])
    for name, value in CONSTANTS.items():
        yield Entry(("functions", name), f"{value:.16g}")
    taken = "the first that is right; in a document the one whose names and dimension fit, if there is one"
    yield Entry(("notation",), "how what people type is read", facts={"taken": taken})
    for each in (*NOTATION, *QUANTITIES):
        readings = "; or ".join(each.readings) + " (answers)" * (each.document == "answers only")
        yield Entry(("notation", each.typed), readings)
    yield Entry(("mistakes",), "what `check` may say")
    for code, sentence in CODES.items():
        yield Entry(("mistakes", code), sentence)
    yield Entry(("conventions",), "signs, orders and axes, as documents and results have them")
    for name, text in CONVENTIONS.items():
        yield Entry(("conventions", name), text)
    yield Entry(("section",), "second moments of area of a beam's section, by their usual names")
    for name, text in SECTION.items():
        yield Entry(("section", name), text)
    yield Entry(("exit-codes",), "what the exit codes mean")
    for number, meaning in EXIT_CODES.items():
        yield Entry(("exit-codes", str(number)), meaning)


def unit(name: str) -> Entry:
    """The entry of a unit, with a prefix or without. Raises ValueProblem for another name."""
    parsed = parse_unit(name)
    dimension = str(parsed.dimension)
    facts = {"is": f"{parsed.scale:.12g} {dimension.partition('(')[2].rstrip(')') or dimension}"}
    facts["names"] = next((names for names, *_ in TABLE if name in names.split() and names != name), "")
    return Entry(("units", name), f"measures {dimension}", facts=facts)


def _shapes() -> Iterator[Entry]:
    """The shapes with their dimensions and anchors."""
    yield Entry(("shapes",), "the shapes of bodies with their dimensions")
    for name, shape in SHAPES.items():
        written, section = shape.dimensions(), _file("document")["$defs"][shape.__name__]
        path = ("document", "body", "shape", name)
        others = ", ".join(key for key in section["properties"] if key not in (*written, "shape"))
        facts = {"also": f"{others}: `rigidcli explain body`"}
        dimensions = ", ".join(written.values())
        yield Entry(path, _first_sentence(section), facts=facts, row=dimensions)
        for key, schema, needed in _keys_in(section):
            if key in written:
                words = "" if written[key] == key else f"{written[key]}; "
                yield Entry((*path, key), words + _summary(schema, needed), "dimensions")
        symbols = {key: EXACT.symbol(key, True) for key in (*written, *"xyz")}
        lists = {
            key: tuple(symbols[axis] for axis in "xyz") for key, words in written.items() if words != key
        }
        sample = SimpleNamespace(**symbols | lists)
        for anchor, at in shape.ANCHORS.items():
            place = f"({', '.join(map(str, at(sample)))})"
            yield Entry((*path, anchor), place, "anchors, in the shape's own axes")


def _keys() -> Iterator[Entry]:
    """The keys of all files that people write, from their JSON Schemas."""
    for name, (text, _) in FILES.items():
        yield Entry((name,), text)
        yield from _below((name,), _file(name), ())
    for name, text in VARIABLES.items():
        yield Entry(("document", "motion", "torque", name), text, "variables of the components")


def _below(path: tuple[str, ...], schema: Schema, above: Sequence[Schema]) -> Iterator[Entry]:
    """The entries of the keys below a value, unless it is a section within itself."""
    every = [section for section in _sections(schema) if not any(section is other for other in above)]
    shapes = [section for section in every if "const" in section["properties"].get("shape", {})]
    forms = [section for section in every if section not in shapes] + shapes[:1]
    shared = set.intersection(*(set(form["properties"]) for form in forms)) if len(forms) > 1 else set()
    for form in forms:
        is_shape, needed = form in shapes, form.get("required", [])[:1]
        needed = needed or [name for choice in form.get("oneOf", ()) for name in choice.get("required", ())]
        group = _first_sentence(form) if len(forms) > 1 else ""
        if group and needed:
            group = f"With `{' or '.join(needed)}`: {group}"
        for name, value, is_needed in _keys_in(form):
            inner, text = (*path, name), _summary(value, is_needed)
            if name in shared:
                if form is forms[-1]:
                    yield Entry(inner, text, "All of them may have")
            elif not is_shape:
                yield Entry(inner, text, group)
            elif name == "shape":
                names = ", ".join(SHAPES)
                yield Entry(inner, "the name of a shape, with its dimensions", "With `shape`", row=names)
            elif name not in SHAPES[form["properties"]["shape"]["const"]].dimensions():
                yield Entry(inner, value["description"], "With `shape`")
            if form is forms[-1] or name not in shared:
                yield from _below(inner, value, (*above, *every))


@cache
def _file(name: str) -> Schema:
    """The schema of one of the FILES."""
    return json_schema(FILES[name][1])


def _referred(schema: Schema) -> Schema:
    """The definition to which a schema refers; a schema without a reference is its own."""
    if "$ref" not in schema:
        return schema
    name = schema["$ref"].rpartition("/")[2]
    return next(definitions[name] for file in FILES if name in (definitions := _file(file)["$defs"]))


def _sections(schema: Schema) -> list[Schema]:
    """The sections that a value may be, at any depth of its lists and choices."""
    schema = _referred(schema)
    if "properties" in schema:
        return [schema]
    entries = [schema.get("items"), schema.get("additionalProperties")]
    inner = [*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("prefixItems", ())]
    inner += [entry for entry in entries if isinstance(entry, dict)]
    return list({id(section): section for entry in inner for section in _sections(entry)}.values())


def _keys_in(section: Schema) -> list[tuple[str, Schema, bool]]:
    """The keys of a section, the schemas of their values, and whether they are needed."""
    needed = section.get("required", ())
    return [(name, schema, name in needed) for name, schema in section["properties"].items()]


def _first_sentence(section: Schema) -> str:
    text = " ".join(str(section.get("description", "")).partition("\n\n")[0].split())
    return text.partition(". ")[0].rstrip(".")


def _is_section(schema: Schema) -> bool:
    """Whether a value is a section, of one form or several, or a list of such sections."""
    schema = _referred(schema)
    choices = [*schema.get("anyOf", ()), *schema.get("oneOf", ())]
    choices += [schema["items"]] if "items" in schema else []
    return "properties" in schema or (bool(choices) and all(map(_is_section, choices)))


def _summary(schema: Schema, is_needed: bool) -> str:
    """A line on a key: the description, the kind of value, the default, and whether it is needed."""
    sections, default = _sections(schema), schema.get("default")
    is_alone = len(sections) == 1 and _is_section(schema)
    sentence = str(schema.get("description", "")) or (_first_sentence(sections[0]) if is_alone else "")
    kind = _kind(schema)
    unit = kind[kind.rfind("(") :] if kind.endswith(")") else ""
    is_said = bool(sentence) and ((unit and unit in sentence) or _is_section(schema))
    has_default = isinstance(default, str | int | float) and str(default) not in ("", "0", "False")
    usual = f"default {default}" if has_default and "default" not in sentence else ""
    return "; ".join(filter(None, [sentence, "" if is_said else kind, usual, "needed" if is_needed else ""]))


_TYPES = {"array": "a list", "boolean": "true or false", "integer": "a whole number", "object": "a mapping"}
"""The types of JSON in the words of documents."""


def _kind(schema: Schema) -> str:
    """The kind of value that a schema allows, in words."""
    if "$ref" in schema:
        definition = _referred(schema)
        return "a mapping" if "properties" in definition else _small(definition["description"])
    if choices := schema.get("anyOf") or schema.get("oneOf"):
        words = dict.fromkeys(map(_entry, choices))
        return (", or " if any("list" in choice for choice in words) else " or ").join(words)
    if "const" in schema or "enum" in schema:
        return " or ".join(map(str, schema.get("enum", [schema.get("const")])))
    if entries := schema.get("prefixItems"):
        each = ", then each ".join(dict.fromkeys(map(_entry, entries)))
        return f"a list of {len(entries)}, each {each}" if "then" not in each else f"a list of {each}"
    if schema.get("type") == "array" and "items" in schema:
        return f"a list, each {_entry(schema['items'])}"
    types = schema.get("type", [])
    names = [types] if isinstance(types, str) else types
    words = dict.fromkeys(_TYPES.get(name, f"a {name}".replace("string", "text")) for name in names)
    return " or ".join(words) or "anything"


def _entry(schema: Schema) -> str:
    """The kind of an entry of a list, or of one of several choices: its description, if it has one."""
    return _small(schema.get("description")) or _kind(schema)


def _small(text: str | None) -> str:
    """A description up to its first semicolon, as part of a sentence."""
    return (text[:1].lower() + text[1:]).partition(";")[0] if text else ""
