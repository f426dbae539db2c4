"""Ensembles: the motions of one document from many starts, row by row, and a summary of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.document.document import Document
from rigidcli.document.motion import Motion
from rigidcli.document.orbit import Orbit
from rigidcli.errors import RigidError, UsageError
from rigidcli.report import Column, Field, Report, Table, single_cells
from rigidcli.studies.pictures import ANY
from rigidcli.studies.results import told

Form: TypeAlias = Literal["rows", "starts", "few"]
"""How an ensemble is written: rows of all samples that begin with the start, a report of each start with all
that is known of it, or a few samples of each, of which a summary is made."""

Found: TypeAlias = tuple[int, Report | RigidError]
"""The place of a start, counted from 0, and a report on it, or on several from it on; or what is wrong."""

Sampling: TypeAlias = Mapping[str, object]
"""Values of the keys of the section with the times, in place of those of the document."""

Together: TypeAlias = Callable[[Document, Sampling], Callable[[range], Iterator[Found]] | None]
"""What makes a function that works the starts at some places at once, or None where they cannot be."""

ROWS = 25_000
"""Rows of a report on several starts, 3 MB: they are worked and written at a time."""

FEW = 6
"""Times of which a summary is made: the first, the last, and some between them."""


def sampling_of(document: Document) -> Motion | Orbit:
    """The section with the times of the ensemble; raises DocumentError where they would not be common."""
    section = document.motion if document.motion is not None and document.motion.ensemble else document.orbit
    assert section is not None
    if section.duration is None and section.times is None:
        raise document.refusal("missing: an ensemble needs times that all starts share", "motion.duration")
    return section


def require_one_start(document: Document, options: Mapping[str, object]) -> None:
    """Raise UsageError where `options` of a study of an ensemble ask for what is made of one start."""
    asked = [name for name in ("picture", "program") if options.get(name) not in (None, False, ANY)]
    starts = document.ensemble
    if asked and starts is not None:
        first = ", ".join(
            f"{name}: {value:g}" for name, value in zip(starts.names, starts.values[0], strict=True)
        )
        one = "motion.omega=[1, 2, 3]" if document.system is None else f"orbit.initial={{{first}}}"
        raise UsageError(
            f"a {asked[0]} is of one start, and there are {len(starts):,}",
            hint=f'set one, such as `--set "{one}"`, or use the rows of `-f csv`',
        )


def block(document: Document) -> int:
    """How many starts are worked at a time, where they are: last digits may depend on it."""
    return max(1, ROWS // len(sampling_of(document).instants(1.0)))


def reports(
    document: Document,
    run: Callable[[Document], Report],
    form: Form,
    places: range,
    together: Together | None = None,
) -> Iterator[Found]:
    """What `run`, a study, finds at these places of the ensemble of a document.

    `together` makes what works several starts at once, where there is such a way. The first place is a
    multiple of `block`. Raises DocumentError where the document has no common times.
    """
    times = sampling_of(document).instants(1.0)
    sampling: dict[str, object] = {}
    if form == "few":
        chosen = np.unique(np.linspace(0, len(times) - 1, FEW).astype(int))
        times = times[chosen]
        sampling = {"duration": None, "step": None, "samples": None, "times": tuple(times.tolist())}
    several = None if together is None or form == "starts" else together(document, sampling)
    if several is not None:
        size = block(document)
        for first in range(places.start, places.stop, size):
            yield from several(range(first, min(first + size, places.stop)))
        return
    for place in places:
        try:
            found = run(document.start(place, **sampling))
        except RigidError as error:
            yield place, error
            continue
        if form == "starts":
            yield place, replace(found, fields=(told("euler", "start", place, title=""), *found.fields))
        else:
            yield place, in_rows(found, place)


def _samples(report: Report) -> Table:
    """The table of the samples of a motion or an orbit."""
    return next(table for table in report.tables if table.data)


def in_rows(found: Report, place: int) -> Report:
    """The samples of a report alone, with the place of the start before them."""
    data = _samples(found)
    start = Column("start", np.full(len(data), place), ("start",))
    return replace(found, tables=(replace(data, columns=(start, *data.columns)),))


@dataclass(slots=True)
class _Moments:
    """Running sums over starts of the values (times by columns): Chan's update of means and products.

    Source: T. F. Chan, G. H. Golub, R. J. LeVeque, The American Statistician 37 (1983) 242.
    """

    count: int = 0
    mean: Floats = field(default_factory=lambda: np.zeros(1))
    products: Floats = field(default_factory=lambda: np.zeros(1))
    least: Floats = field(default_factory=lambda: np.array(np.inf))
    most: Floats = field(default_factory=lambda: np.array(-np.inf))

    def add(self, values: Floats) -> None:
        """Take in some starts (m by times by columns)."""
        m, mean = len(values), values.mean(axis=0)
        off = values - mean
        products = np.einsum("mti,mtj->tij", off, off)
        apart = mean - self.mean if self.count else np.zeros_like(mean)
        share = m / (self.count + m)
        self.products = self.products + products if self.count else products
        self.products = self.products + np.einsum("ti,tj->tij", apart, apart) * (self.count * share)
        self.mean = self.mean + apart * share if self.count else mean
        self.least = np.minimum(self.least, values.min(axis=0))
        self.most = np.maximum(self.most, values.max(axis=0))
        self.count += m

    @property
    def covariance(self) -> Floats:
        """The covariance (times by columns by columns), of the whole ensemble: the divisor is its number."""
        return self.products / self.count


def summaries(found: Iterable[Report]) -> Iterator[Report]:
    """One report instead of the reports on the starts of an ensemble, and all others as they are."""
    for (_, _, is_part), group in groupby(found, lambda one: (one.source, one.name, _is_part(one))):
        yield from _told(group, is_part=is_part)


def _told(found: Iterator[Report], *, is_part: bool) -> Iterator[Report]:
    """The summary of reports that are parts of an ensemble, or the reports."""
    if is_part:
        yield _summary(found)
    yield from found


def _is_part(report: Report) -> bool:
    data = next((table for table in report.tables if table.data), None)
    return data is not None and data.columns[0].key == "start"


def _summary(found: Iterator[Report]) -> Report:
    """The summary of an ensemble from the reports on its starts, with a few samples a start."""
    first = next(found)
    moments, notes = _Moments(), dict.fromkeys(first.notes)
    columns = _variables(first)
    times = np.unique(columns[0].values)
    digits = _digits(first)
    moments.add(_values(first, len(times)))
    for report in found:
        moments.add(_values(report, len(times)))
        notes |= dict.fromkeys(report.notes)
        digits = min(digits, _digits(report))
    spread = np.sqrt(np.einsum("tii->ti", moments.covariance))
    rows = {"mean": moments.mean, "deviation": spread, "least": moments.least, "most": moments.most}
    tables = tuple(
        Table(
            "",
            f"{column.cells[0]} over the starts",
            (
                Column("t", times, ("t",), "s", ("t",)),
                *(
                    Column(key, values[:, place], (told("euler", key, None).title,), column.unit)
                    for key, values in rows.items()
                ),
            ),
        )
        for place, column in enumerate(columns[1:])
    )
    fields = [told("euler", "starts", moments.count)]
    if np.isfinite(digits):
        fields.append(Field("trusted_digits", digits, "trusted digits, the least of all"))
    if (volume := _volume(first, columns, moments)) is not None:
        tables = (*tables, volume(times))
    return replace(
        first, fields=tuple(fields), tables=tables, notes=tuple(notes), steps=(), pictures=(), scene=None
    )


def _variables(report: Report) -> list[Column]:
    """The time, and each variable that people are shown, in single cells."""
    data = _samples(report)
    shown = replace(data, columns=tuple(c for c in data.columns[1:] if not c.hidden))
    return single_cells(shown)


def _values(report: Report, times: int) -> Floats:
    """The variables of a report (starts by times by variables)."""
    columns = _variables(report)[1:]
    values: Floats = np.stack([column.values for column in columns], axis=-1)
    return values.reshape(-1, times, len(columns))


def _digits(report: Report) -> float:
    """The trusted digits of a report; infinite where it has none."""
    known = (entry.value for entry in report.fields if entry.key.endswith("trusted_digits"))
    return float(next(known, np.inf))


def _volume(report: Report, columns: list[Column], moments: _Moments) -> Callable[[Floats], Table] | None:
    """The table of the volume that an ensemble of orbits fills in phase space; None where it fills none."""
    data = _samples(report)
    phase = [c.cells[0] for c in data.columns if c.key.startswith(("q.", "p."))]
    if not phase or moments.count <= len(phase):
        return None
    places = [index for index, column in enumerate(columns[1:]) if column.cells[0] in phase]
    covariance = moments.covariance[:, places][:, :, places]
    root = np.sqrt(np.maximum(np.linalg.det(covariance), 0.0))

    def table(times: Floats) -> Table:
        return Table(
            "",
            "spread in phase space: the root of the determinant of the covariance",
            (
                Column("t", times, ("t",), "s", ("t",)),
                Column("volume", root, (told("hamilton", "volume", None).title,)),
            ),
        )

    return table


def whole(document: Document, run: Callable[[Document], Report], together: Together | None = None) -> Report:
    """All samples of an ensemble in one report, the start before each. Raises the first error there is."""
    assert document.ensemble is not None
    parts = []
    for place, found in reports(document, run, "rows", range(len(document.ensemble)), together):
        if isinstance(found, RigidError):
            found.message = f"start {place}: {found.message}"
            raise found
        parts.append(found)
    first = parts[0]
    tables = [_samples(part) for part in parts]
    columns = tuple(
        replace(column, values=np.concatenate([table.columns[place].values for table in tables]))
        for place, column in enumerate(tables[0].columns)
    )
    fields = (told("euler", "starts", len(document.ensemble)),)
    notes = tuple(dict.fromkeys(note for part in parts for note in part.notes))
    return replace(first, fields=fields, notes=notes, tables=(replace(tables[0], columns=columns),))
