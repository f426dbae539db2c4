"""Ensembles: the motions of one document from many starts, in rows, and a summary over the starts."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, groupby
from typing import TYPE_CHECKING, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.document.document import Document
from rigidcli.errors import RigidError, UsageError
from rigidcli.report import Column, Field, Report, Table, single_cells
from rigidcli.studies.common import SHOWN_DIGITS, field_of, require_values
from rigidcli.studies.pictures import ANY, BEST

if TYPE_CHECKING:
    from rigidcli.document.motion import Motion
    from rigidcli.document.system import Orbit
    from rigidcli.picture import Picture

# What a report on a start holds: all samples, the whole report of the study, or samples at a few times.
Form: TypeAlias = Literal["rows", "starts", "few"]
# The place of a start, counted from 0, and a report on it and perhaps on the next starts, or its error.
# None stands for a start that is to be followed alone.
StartReport: TypeAlias = tuple[int, Report | RigidError | None]
# Makes a function that follows the starts at some places in arrays; None where arrays are of no use.
InArrays: TypeAlias = Callable[[Document, Form], Callable[[range], Iterator[StartReport]] | None]
# The most rows of a report on several starts: they take 3 MB of memory.
MOST_ROWS = 25_000
# Times of a summary: a table of them fits on a screen.
SUMMARY_TIMES = 6
# Times at which the starts of a system are drawn.
DRAWN_TIMES = 4


def sampling_of(document: Document) -> Motion | Orbit:
    """The section with the times of the ensemble. Raises DocumentError where starts share no times."""
    section = document.motion if document.motion is not None and document.motion.ensemble else document.orbit
    assert section is not None
    require_values(document, "an ensemble")
    if section.duration is None and section.times is None:
        raise document.refusal("missing: an ensemble needs times that all starts share", "motion.duration")
    return section


def require_one_start(document: Document, options: Mapping[str, object]) -> None:
    """Raise UsageError where `options` ask for a picture or a program, and there are several starts."""
    asked = [name for name in ("picture", "program") if options.get(name) not in (None, False, ANY)]
    if document.system is not None and options.get("picture") in (BEST, "phase"):
        asked.remove("picture")
    starts = document.ensemble
    if asked and starts is not None:
        first = ", ".join(f"{name}: {value:g}" for name, value in starts.start(0).items())
        one = "motion.omega=[1, 2, 3]" if document.system is None else f"orbit.initial={{{first}}}"
        raise UsageError(
            f"a {asked[0]} shows one start, and there are {len(starts):,}",
            hint=f'set one, such as `--set "{one}"`, or use the rows of `-f csv`',
        )


def block(document: Document) -> int:
    """How many starts are worked as arrays at a time; the last digits may depend on it."""
    return max(1, MOST_ROWS // len(sampling_of(document).instants(1.0)))


def may_go_in_arrays(document: Document) -> bool:
    """Whether the starts of an ensemble are integrated in arrays, as far as the document tells."""
    section, system = sampling_of(document), document.system
    is_free = system is None or not (system.constraints or (document.orbit and document.orbit.events))
    # heyoka follows several orbits at once, but not several bodies.
    return is_free and (section.method == "auto" or (system is not None and section.method == "taylor"))


def reports(
    document: Document,
    run: Callable[[Document], Report],
    form: Form,
    places: range,
    together: InArrays | None = None,
) -> Iterator[tuple[int, Report | RigidError]]:
    """The reports of `run`, a study, on the starts at these places of an ensemble, or their errors.

    `together` may follow several starts in arrays. The first place is a multiple of `block`. Raises
    DocumentError where the starts do not share their times.
    """
    if form == "few" and document.orbit is not None and document.orbit.events:
        key = next(iter(document.orbit.events))
        hint = "print them all: `-f csv` or `-f json`"
        raise document.refusal("the starts have no times in common to sum up", key, hint=hint)
    size = block(document)
    parts: Iterable[StartReport] = ((place, None) for place in places)
    several = None if together is None else together(document, form)
    if several is not None:
        blocks = (places[first : first + size] for first in range(0, len(places), size))
        parts = chain.from_iterable(map(several, blocks))
    for place, one in parts:
        result = one if one is not None else _alone(document, run, form, place)
        if form == "few" and isinstance(result, Report):
            result = replace(result, tables=(_few(_samples(result)),))
        yield place, result


def _alone(
    document: Document, run: Callable[[Document], Report], form: Form, place: int
) -> Report | RigidError:
    try:
        result = run(document.start(place))
    except RigidError as error:
        return error
    if form == "starts":
        return of_start(result, place)
    return replace(result, tables=(with_start(_samples(result), np.array([place])),))


def of_start(report: Report, place: int) -> Report:
    """The whole report on a start, with its place."""
    return replace(report, fields=(field_of("euler", "start", place, title=""), *report.fields))


def _few(samples: Table) -> Table:
    """The samples of each start at a few times, the first and the last among them."""
    count = int(np.count_nonzero(samples.columns[0].values == samples.columns[0].values[0]))
    some = _spread(count, SUMMARY_TIMES)
    rows = np.arange(len(samples)).reshape(-1, count)[:, some].ravel()
    return replace(samples, columns=tuple(replace(one, values=one.values[rows]) for one in samples.columns))


def _spread(count: int, most: int) -> NDArray[np.int_]:
    """At most so many places from 0 to `count` - 1, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, most).astype(int))


def with_start(samples: Table, places: Floats) -> Table:
    """The samples of the motions from the starts at these places, with the place before each row."""
    start = Column("start", np.repeat(places, len(samples) // len(places)), ("start",))
    return replace(samples, columns=(start, *samples.columns))


def swarm(reports: Sequence[Report]) -> Picture:
    """The starts of a system in the plane of its first coordinate and momentum, at some of the times."""
    from rigidcli.picture import Mark, Panel, Picture, PictureAxis

    columns = {column.key: column for column in _joined(reports).columns}
    plane = [next(columns[key] for key in columns if key.startswith(kind)) for kind in ("q.", "p.")]
    rulers = tuple(PictureAxis(column.cells[0], (column.symbols or ("",))[0]) for column in plane)
    t, panels = columns["t"].values, []
    times = np.unique(t)
    for time in times[_spread(len(times), DRAWN_TIMES)]:
        dots = np.column_stack([column.values[t == time] for column in plane])
        panels.append(Panel(rulers, (Mark("dots", dots),), f"t = {time:.4g} s"))
    return Picture("phase", "the starts in phase space", tuple(panels), min(2, len(panels)))


def whole(document: Document, run: Callable[[Document], Report], together: InArrays | None = None) -> Report:
    """All samples of an ensemble in one report. Raises the error of the first bad start."""
    assert document.ensemble is not None
    parts = []
    for place, part in reports(document, run, "rows", range(len(document.ensemble)), together):
        if isinstance(part, RigidError):
            part.message = f"start {place}: {part.message}"
            raise part
        parts.append(part)
    fields = (field_of("euler", "starts", len(document.ensemble)),)
    notes = tuple(dict.fromkeys(note for part in parts for note in part.notes))
    return replace(parts[0], fields=fields, notes=notes, tables=(_joined(parts),))


def _joined(reports: Sequence[Report]) -> Table:
    """The samples of all reports in one table."""
    tables = [_samples(report) for report in reports]
    columns = zip(*(table.columns for table in tables), strict=True)
    joined = (replace(one[0], values=np.concatenate([column.values for column in one])) for one in columns)
    return replace(tables[0], columns=tuple(joined))


def summaries(reports: Iterable[Report]) -> Iterator[Report]:
    """The reports, in which one summary replaces the reports on the starts of an ensemble."""
    for (_, _, is_part), group in groupby(reports, lambda one: (one.source, one.name, _is_part(one))):
        if is_part:
            yield _summary(group)
        else:
            yield from group


def _is_part(report: Report) -> bool:
    return report.data is not None and report.data.columns[0].key == "start"


def _summary(parts: Iterator[Report]) -> Report:
    """The summary of an ensemble from reports with samples of its starts at the same few times."""
    notes: dict[str, None] = {}
    gathered: list[Floats] = []
    first, digits = next(parts), np.inf
    for part in chain([first], parts):
        columns = single_cells(_samples(part))
        t, *shown = (column for column in columns[1:] if not column.hidden)
        times = np.unique(t.values)
        values = np.stack([column.values for column in shown], axis=-1)
        gathered.append(values.reshape(-1, len(times), len(shown)))
        notes |= dict.fromkeys(part.notes)
        digits = min([digits, *(f.value for f in part.fields if f.key.endswith("trusted_digits"))])
    starts = np.concatenate(gathered)  # starts by times by variables
    mean = starts.mean(axis=0)
    over = {"mean": mean, "deviation": starts.std(axis=0), "least": starts.min(axis=0)}
    over["most"] = starts.max(axis=0)
    heads = {key: (field_of("euler", key, None).title,) for key in over}
    tables = [
        Table(
            "",
            f"{variable.cells[0]} over the starts",
            (
                Column("t", times, ("t",), "s", ("t",)),
                *(Column(key, values[:, k], heads[key], variable.unit) for key, values in over.items()),
            ),
        )
        for k, variable in enumerate(shown)
    ]
    fields = [field_of("euler", "starts", len(starts))]
    if np.isfinite(digits):
        is_good = digits >= SHOWN_DIGITS
        fields.append(Field("trusted_digits", digits, "trusted digits, the least of all", diagnostic=is_good))
    summary = replace(first, fields=tuple(fields), tables=tuple(tables), notes=tuple(notes))
    return replace(summary, steps=(), pictures=(), scene=None)


def starts_in(report: Report) -> int:
    """How many starts of an ensemble a report is about."""
    return len({*_samples(report).columns[0].values.tolist()}) if _is_part(report) else 1


def _samples(report: Report) -> Table:
    return next(table for table in report.tables if table.data)
