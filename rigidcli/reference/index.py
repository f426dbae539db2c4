"""Where a name is explained: the page of a topic, a key, a shape, a unit, a result, a mistake."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

from rigidcli.errors import UsageError, nearest, shown
from rigidcli.reference import tables
from rigidcli.reference.page import page, paragraph, rows


def _of_keys(page: str, *arguments: Any) -> Callable[[], str]:
    """A page of the module on keys, which loads all models."""
    return lambda: str(getattr(import_module("rigidcli.reference.keys"), page)(*arguments))


def _results() -> str:
    commands = [(name, ", ".join(field.key for field in fields)) for name, fields in tables.results().items()]
    common = "In json, all have `schema`, `name`, `source` and `units`, too, and with `--sweep` also `swept`."
    return page("results of each command", rows(commands), paragraph(common))


TOPICS: dict[str, tuple[str, Callable[[], str]]] = {
    "document": ("the keys at the top of a document", _of_keys("top", 0)),
    "assignment": ("the keys of an assignment of `check`", _of_keys("assignment")),
    "answers": ("the keys of an answer file", _of_keys("top", 2)),
    "files": ("the files that commands read, by the endings of their names", tables.files),
    "shapes": ("the shapes of bodies with their dimensions", _of_keys("shapes_page")),
    "units": ("units of quantities such as `5 cm`", tables.units),
    "functions": ("functions in expressions", tables.functions),
    "results": ("what each command finds: the fields of its json", _results),
    "mistakes": ("what `check` may say", lambda: page("mistakes", rows([*tables.mistakes().items()]))),
    "exit-codes": ("what the exit codes mean", tables.exit_codes),
}
"""What there is to be explained: each topic with a line about it, and its page."""

EXAMPLES = ("body", "body.shape.cone", "motion.omega", "axes.groups", "rpm", "atan2", "sign_error")


def overview() -> str:
    """What there is."""
    listed = [(name, about) for name, (about, _) in TOPICS.items()]
    examples = "\n".join(f"  rigidcli explain {example}" for example in EXAMPLES)
    return page(
        paragraph("`rigidcli explain PATH` tells what a key, shape, unit, function, result or mistake is."),
        rows(listed),
        "Examples:\n" + examples,
    )


def explain(path: str) -> str:
    """The page of a path, or of what has that name anywhere. Raises UsageError for what is unknown."""
    if path in TOPICS:
        return TOPICS[path][1]()
    command, _, key = path.partition(".")
    known = tables.results()
    if command in known and not key:
        return page(f"results of `rigidcli {command}`", tables.result_rows(known[command]))
    found = [tables.result(path, field) for field in known.get(command, ()) if field.key == key]
    found += [] if found else _below(command, key)
    if not found:
        from rigidcli.reference import keys

        place = keys.find(tuple(path.split(".")))
        found = [] if place is None else [keys.explained(place)]
        found = found or _by_name(path)
    if found:
        return "\n".join(found)
    near = nearest(path, _names(path))
    hint = "`rigidcli explain` lists what there is"
    guess = f" (did you mean {near}?)" if near else ""
    raise UsageError(f"nothing is called {shown(path)}{guess}", hint=hint)


def _below(command: str, key: str) -> list[str]:
    """The results below a key such as `precess.top`."""
    fields = [field for field in tables.results().get(command, ()) if field.key.startswith(f"{key}.")]
    return [page(f"{command}.{key}", tables.result_rows(tuple(fields)))] if key and fields else []


def _by_name(name: str) -> list[str]:
    """Pages of what has a name, wherever it is; mistakes come last, as they take long to load."""
    from rigidcli.bodies.shapes import SHAPES
    from rigidcli.language.functions import FUNCTIONS, RESERVED
    from rigidcli.reference import keys

    if name in ("shape", "anchor", "density") and (place := keys.find(("body", name))) is not None:
        return [keys.explained(place)]
    if name in SHAPES:
        return [keys.shape_page(name, SHAPES[name])]
    if name in FUNCTIONS or name in RESERVED:
        return [tables.functions()]
    found = list(dict.fromkeys(keys.explained(key) for key in keys.every() if key.path[-1] == name))
    found += filter(None, [keys.dimension_page(name)])
    found += tables.results_called(name) + tables.torque_variable(name)
    if not found and (unit := tables.unit(name)) is not None:
        found = [unit]
    if not found and (says := tables.mistakes().get(name)) is not None:
        found = [page(f"{name}: a finding of `check`", paragraph(says))]
    return found


def _names(path: str) -> list[str]:
    """What may have been meant by a path that is not there: the names at its last step."""
    from rigidcli.bodies.shapes import SHAPES
    from rigidcli.reference import keys

    above, _, _ = path.rpartition(".")
    if above in tables.results():
        return [f"{above}.{field.key}" for field in tables.results()[above]]
    place = keys.find(tuple(above.split("."))) if above else None
    if place is not None:
        steps = {name for section in place.sections for name in section.model_fields}
        steps |= set(SHAPES) if above.startswith("body") else set()
        return sorted(f"{above}.{step}" for step in steps)
    names = {key.path[-1] for key in keys.every()} | set(TOPICS) | set(SHAPES) | set(tables.results())
    return sorted(names)
