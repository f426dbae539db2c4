"""Reading of a file or text: a document, or all that is wrong with it, each problem with its line."""

from __future__ import annotations

import os
import pathlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from typing import TypeAlias

from pydantic import ValidationError

from rigidcli.core.arithmetic import FLOAT, Arithmetic
from rigidcli.document.document import Document
from rigidcli.document.parameters import read_parameters
from rigidcli.document.places import BodyPlaces, Places, body_form
from rigidcli.document.settings import SWEEP, Change, apply, split_setting
from rigidcli.document.syntax import read_tree
from rigidcli.errors import UNSETTLED, DocumentError, Path, ValueProblem, shown
from rigidcli.fields.environment import Environment
from rigidcli.fields.texts import STDIN, read_text
from rigidcli.fields.words import with_colon

_Decimal: TypeAlias = Callable[[str], object]
"""What makes a number of a decimal as it is typed."""

_TYPES = {
    "tuple_type": "a list, such as [0, 0, 1]",
    "dict_type": "a mapping",
    "model_type": "a mapping",
    "string_type": "a text",
    "bool_type": "true or false",
    "int_type": "a whole number",
    "greater_than_equal": "at least {ge}",
    "less_than_equal": "at most {le}",
}
"""What pydantic's complaints about a type or a bound expect, in the words of a document."""


_FLAT = {
    "inertia": "principal moments are written `moments: [1, 2, 3]`, a tensor by its rows",
    "points": "each point is a list, also a single one: `points: [[m, x, y, z]]`",
}
"""What to write for a list of numbers where one of lists is expected."""


def load(
    path: str | os.PathLike[str],
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    options: Mapping[str, str] | None = None,
) -> Document:
    """Read the document in the file `path`; `-` is standard input.

    A file that is a body by itself, such as a table of points, stands for the document that has it as its
    body, and the `settings` complete that.

    `exact` makes decimals rationals and parameters without a value symbols; a document that has such a
    parameter is exact in any case. One of a system keeps its expressions as they are, and has floats for
    the numbers that it needs. `settings` are texts `key=value`, as after `--set`; `options` has the keys of
    those that an option of its own has given, with its name. Raises DocumentError with
    all problems, or UsageError for a setting that is not of that form.
    """
    return draft(path, exact=exact, settings=settings, options=options).document()


def loads(
    text: str,
    *,
    source: str = "<text>",
    folder: pathlib.Path | None = None,
    exact: bool = False,
    settings: Sequence[str] = (),
    options: Mapping[str, str] | None = None,
) -> Document:
    """Read the document in `text`, as `load` does; files that it names are looked for in `folder`."""
    return Draft(Places(text, source), folder or pathlib.Path(), exact, settings, options or {}).document()


def draft(
    path: str | os.PathLike[str],
    *,
    exact: bool = False,
    settings: Sequence[str] = (),
    options: Mapping[str, str] | None = None,
) -> Draft:
    """What stands in the file `path`, as `load` reads it, but not yet read as a document."""
    name = os.fspath(path)
    folder = pathlib.Path() if name == STDIN else pathlib.Path(name).parent
    # A file name may have bytes that are no text.
    source = os.fsencode(name).decode(errors="backslashreplace")
    form = body_form(name)
    places = Places(read_text(name, source), source) if form is None else BodyPlaces(name, source, form)
    return Draft(places, folder, exact, settings, options or {})


@dataclass
class Draft:
    """What a document is made of, of which some values may still change; its syntax is read once.

    The other fields are what `load` takes. `swept` are texts `KEY=VALUE` of `--sweep`.
    """

    places: Places
    folder: pathlib.Path
    exact: bool
    settings: Sequence[str]
    options: Mapping[str, str]
    _trees: dict[_Decimal, tuple[object, dict[Path, str]]] = field(default_factory=dict)

    @property
    def source(self) -> str:
        """The name of the file."""
        return self.places.source

    @property
    def text(self) -> str:
        """What is typed; below it, in comments, what is set from outside. Raises as `load`."""
        _, changed = self._changed((), float)
        return self.places.with_changes(changed, self.settings).whole

    def absolute(self) -> Draft:
        """The same draft for a process in another folder, which reads the files that the document names."""
        folder = self.folder.absolute()
        return replace(self, folder=folder, places=self.places.within(folder))

    def document(self, swept: Sequence[str] = ()) -> Document:
        """The document with these values swept; each call must give the same keys. Raises as `load`."""
        tree, changed = self._changed(swept, float)
        exact = self.exact or _has_symbols(tree)
        if exact:
            # Read again, so that decimals are kept digit by digit.
            tree, _ = self._changed(swept, Decimal)
        places = self.places.with_changes(changed, (*self.settings, *swept))
        return _document(tree, places, self.folder, _arithmetic(exact))

    def is_exact(self, swept: Sequence[str]) -> bool:
        """Whether the document is worked exactly with these values swept. Raises as `load`."""
        return self.exact or _has_symbols(self._changed(swept, float)[0])

    def _changed(self, swept: Sequence[str], decimal: _Decimal) -> tuple[object, dict[Path, str]]:
        """The tree with all that is given from outside, and what gave each value.

        The values of a sweep take the places of those of the last time.
        """
        if decimal not in self._trees:
            names: dict[Path, str] = {tuple(key.split(".")): name for key, name in self.options.items()}
            changes = _changes(self.settings, names, decimal)
            tree, paths = apply(self.places.tree(decimal), changes, self.source)
            self._trees[decimal] = tree, {path: names.get(path, "--set") for path in paths}
        tree, changed = self._trees[decimal]
        if not swept:
            return tree, changed
        tree, paths = apply(tree, _changes(swept, {}, decimal, SWEEP), self.source, SWEEP)
        return tree, changed | dict.fromkeys(paths, SWEEP)


def _changes(
    settings: Sequence[str],
    options: Mapping[Path, str],
    decimal: _Decimal,
    option: str = "--set",
) -> list[Change]:
    """The settings with their values read, which are YAML, too."""
    changes = []
    for path, text in map(split_setting, settings):
        name = options.get(path, f"{option} {'.'.join(map(str, path))}")
        changes.append((path, read_tree(text, name, decimal)))
    return changes


def _has_symbols(tree: object) -> bool:
    """Whether a parameter stands without a value."""
    parameters = tree.get("parameters") if isinstance(tree, dict) else None
    return isinstance(parameters, dict) and None in parameters.values()


def _document(tree: object, places: Places, folder: pathlib.Path, wanted: Arithmetic) -> Document:
    """The document of a tree, with its mass properties; DocumentError with all problems otherwise.

    `wanted` is the kind of number of the results.
    """
    if not isinstance(tree, dict):
        read = "an empty document" if tree is None else shown(tree)
        typed = tree if isinstance(tree, str) else ""
        cure = with_colon(typed)
        hint = cure and f"write `{cure}`"
        if tree is None:
            hint = "`rigidcli new` prints a document to start from"
        problem = ValueProblem(f"read {read}, expected a mapping", hint=hint, typed=cure and typed)
        raise DocumentError([places.problem(problem)])
    positive: frozenset[str] = frozenset()
    while True:
        arithmetic = FLOAT if wanted.exact and _is_symbolic(tree) else wanted
        env = Environment(arithmetic, folder=folder, exact_results=wanted.exact)
        raw = tree.get("parameters")
        problems = read_parameters(env, raw, positive) if isinstance(raw, dict) else []
        document = None
        try:
            document = Document.model_validate(tree, context=env)
            if not problems and not env.faults:
                document.physical.require()
        except ValidationError as error:
            problems += explain(error)
        except ValueProblem as problem:
            problems.append(problem)
        problems += [fault.below("parameters", name) for name, fault in sorted(env.faults.items())]
        if problems:
            told = [problem for problem in problems if problem.code != UNSETTLED]
            raise DocumentError(sorted(map(places.problem, told), key=lambda placed: placed.line or 0))
        assert document is not None
        if env.positive <= positive:
            break
        # Symbols that stand for masses and lengths are positive; knowing that, read once more.
        positive = positive | env.positive
    unused = sorted((env.parameters.keys() | env.open.keys()) - env.used)
    notes = list(dict.fromkeys(env.notes))
    if document.body is not None:
        from rigidcli.document.traps import traps

        notes += traps(document, tree)
    if document.orbit is not None and document.system is not None and document.orbit.ensemble is None:
        notes += document.orbit.degrees_meant(document.system, tree["orbit"]["initial"])
    notes += [f"parameter `{name}` is not used" for name in unused]
    return document.came_from(places.source, places.whole, notes, places.of)


def _is_symbolic(tree: Mapping[str, object]) -> bool:
    """Whether a document has a system alone, whose expressions stay symbolic and whose numbers are floats."""
    return tree.get("system") is not None and all(tree.get(key) is None for key in ("body", "top", "tide"))


def _arithmetic(exact: bool) -> Arithmetic:
    if not exact:
        return FLOAT
    from rigidcli.algebra.arithmetic import EXACT

    return EXACT


def explain(error: ValidationError) -> list[ValueProblem]:
    """Every complaint of pydantic, in the document's words."""
    explained: dict[Path, ValueProblem] = {}
    for complaint in error.errors(include_url=False):
        path, kind, read = complaint["loc"], complaint["type"], complaint["input"]
        typed, code = None, ""
        context = complaint.get("ctx", {})
        problem, hint = context.get("error"), None
        if isinstance(problem, ValueProblem):
            path, message, hint = (*path, *problem.path), problem.message, problem.hint
            typed, code = problem.typed, problem.code
        elif kind == "missing" and isinstance(last := path[-1], int):
            # A list that is too short lacks each of its last entries; that is one problem.
            path, message = path[:-1], f"read {shown(read)}, expected {last + 1} entries"
        elif kind == "missing":
            message = "missing"
        elif kind == "too_short" and len(read) >= context["min_length"]:
            continue  # long enough, but for the entries that have problems of their own
        elif kind in ("too_long", "too_short"):
            bound = context.get("max_length", context.get("min_length"))
            most = "at most" if kind == "too_long" else "at least"
            message = f"read {shown(read)}, expected {most} {bound} {'entry' if bound == 1 else 'entries'}"
        else:
            if kind == "tuple_type" and path[-1] == 0:
                # A list of numbers where one of lists is expected: one problem for all its entries.
                path, hint = path[:-1], _FLAT.get(str(path[-2]))
            elif kind == "tuple_type" and path[:-1] in explained:
                continue
            expected = _TYPES.get(kind, str(context.get("expected", complaint["msg"]))).format(**context)
            entry = "entry " if path != complaint["loc"] else ""
            message = f"read {entry}{shown(read)}, expected {expected.replace(chr(39), '')}"
            if (
                kind == "string_type"
                and isinstance(read, int | float | Decimal)
                and not isinstance(read, bool)
            ):
                hint = f'write it in quotes: "{read}"'
            elif kind == "tuple_type" and isinstance(read, str) and "," in read:
                hint, typed = f"write `[{read.strip('[]() ')}]`", read
            elif kind == "dict_type" and path == ("parameters",):
                names = ", ".join(f"{name}: null" for name in re.findall(r"[^\W\d]\w*", str(read)))
                hint = f"write `parameters: {{{names}}}`, with values where there are some"
        explained[path] = ValueProblem(message, path=path, hint=hint, typed=typed)
        explained[path].code = code
    return list(explained.values())
