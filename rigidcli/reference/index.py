"""Where a name is explained: the page of a topic, a key, a shape, a unit, a result, a mistake."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from rigidcli.errors import UsageError, nearest, shown
from rigidcli.reference import tables
from rigidcli.reference.page import page, paragraph, rows
from rigidcli.studies.results import RESULTS


def _of_keys(function: str, *arguments: str) -> Callable[[], str]:
    """A page of the module on keys, which loads all models."""
    return lambda: str(getattr(import_module("rigidcli.reference.keys"), function)(*arguments))


TOPICS: dict[str, tuple[str, Callable[[], str]]] = {
    "document": ("the keys at the top of a document", _of_keys("file_page", "document")),
    "assignment": ("the keys of an assignment of `check`", _of_keys("file_page", "assignment")),
    "answers": ("the keys of an answer file", _of_keys("file_page", "answers")),
    "files": ("the files that commands read, by the endings of their names", tables.files),
    "shapes": ("the shapes of bodies with their dimensions", _of_keys("shapes_page")),
    "units": ("units of quantities such as `5 cm`", tables.units),
    "functions": ("functions in expressions", tables.functions),
    "results": ("what each command finds: the fields of its json", tables.results),
    "mistakes": ("what `check` may say", tables.mistakes),
    "exit-codes": ("what the exit codes mean", tables.exit_codes),
}
"""The topics, each with a line about it, and its page."""

EXAMPLES = ("body", "body.shape.cone", "motion.omega", "axes.groups", "rpm", "atan2", "sign_error")


def overview() -> str:
    """The page of `explain` without a path: the topics, and examples."""
    return page(
        paragraph("`rigidcli explain PATH` tells what a key, shape, unit, function, result or mistake is."),
        rows([(name, about) for name, (about, _) in TOPICS.items()]),
        "Examples:\n" + "\n".join(f"  rigidcli explain {example}" for example in EXAMPLES),
    )


def explain(path: str) -> str:
    """The page of a path, or of what has that name anywhere. Raises UsageError for an unknown name."""
    if path in TOPICS:
        return TOPICS[path][1]()
    command, _, key = path.partition(".")
    fields = RESULTS.get(command, ())
    if fields and not key:
        return page(f"results of `rigidcli {command}`", tables.result_rows(command))
    if field := next((field for field in fields if field.key == key), None):
        return tables.result(path, field)
    if key and any(field.key.startswith(f"{key}.") for field in fields):
        return page(f"{command}.{key}", tables.result_rows(command, f"{key}."))
    from rigidcli.reference import keys

    place = keys.find(tuple(path.split(".")))
    if pages := _by_name(path) if place is None else [keys.explained(place)]:
        return "\n".join(pages)
    near = nearest(path, _names(path))
    guess = f" (did you mean {near}?)" if near else ""
    hint = "`rigidcli explain` lists what there is"
    raise UsageError(f"nothing is called {shown(path)}{guess}", hint=hint)


def _by_name(name: str) -> list[str]:
    """The pages that are about a name; units and mistakes only where nothing else is called so."""
    from rigidcli.bodies.shapes import SHAPES
    from rigidcli.language.functions import FUNCTIONS, RESERVED
    from rigidcli.reference import keys

    if name in ("shape", "anchor", "density") and (place := keys.find(("body", name))) is not None:
        return [keys.explained(place)]
    if name in SHAPES:
        return [keys.shape_page(name)]
    if name in FUNCTIONS or name in RESERVED:
        return [tables.functions()]
    pages = list(dict.fromkeys(keys.explained(key) for key in keys.every() if key.path[-1] == name))
    pages += [*keys.dimension_pages(name), *tables.results_called(name), *tables.torque_variable(name)]
    return pages or tables.unit(name) or tables.mistake(name)


def _names(path: str) -> list[str]:
    """The paths that may have been meant by an unknown one: those with its beginning, or all short names."""
    from rigidcli.bodies.shapes import SHAPES
    from rigidcli.reference import keys

    above, _, _ = path.rpartition(".")
    if above in RESULTS:
        return [f"{above}.{field.key}" for field in RESULTS[above]]
    place = keys.find(tuple(above.split("."))) if above else None
    if place is not None:
        steps = {name for section in keys.sections(place.schema) for name in section["properties"]}
        steps |= set(SHAPES) if above.startswith("body") else set()
        return sorted(f"{above}.{step}" for step in steps)
    return sorted({*(key.path[-1] for key in keys.every()), *TOPICS, *SHAPES, *RESULTS})
