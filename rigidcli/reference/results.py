"""The entries of `explain`, and those of results, which load nothing else."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from rigidcli.studies.results import RESULTS


class Entry(NamedTuple):
    """What is explained: the way to it from a topic, a text, and further facts by their names.

    The page of the entry above lists it under the heading `group`, with the text of its `row`, which mostly
    is the same. It is also found by `other_names`.
    """

    path: tuple[str, ...]
    text: str = ""
    group: str = ""
    facts: Mapping[str, str] = {}
    other_names: Sequence[str] = ()
    row: str = ""


def results() -> Iterator[Entry]:
    """The results of every command, from results.csv."""
    common = "all have `schema`, `name`, `source` and `units`, too, and with `--sweep` also `swept`"
    yield Entry(("results",), "the results of each command: the fields of its json", facts={"json": common})
    for command, fields in RESULTS.items():
        keys = ", ".join(field.key for field in fields)
        yield Entry(("results", command), f"results of `rigidcli {command}`", row=keys)
        for group in dict.fromkeys(field.key.partition(".")[0] for field in fields if "." in field.key):
            if all(field.key != group for field in fields):
                yield Entry(("results", command, group), f"results of `{command}` under `{group}`")
        for field in fields:
            words = "; ".join(filter(None, [field.title.strip(), field.means]))
            words = words or f"the {field.key.rpartition('.')[2].replace('_', ' ')}"
            text = f"{words} ({field.unit})" if field.unit else words
            facts = {"symbol": field.symbol and f"{field.symbol} (LaTeX)", "csv": ", ".join(field.cells)}
            yield Entry(("results", command, *field.key.split(".")), text, "", facts, [*field.cells])
