"""XML -> elements with their lines and numbers, by expat of the standard library, from a text alone.

A document type is refused as soon as it begins, and with it every entity that a file may define: those that
grow without bound as well as those that name other files. Depth and count are bounded here, the size of a
text where it is read.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Any
from xml.parsers import expat

from rigidcli.errors import DocumentError, Problem, shown
from rigidcli.language.tokens import NUMERAL

MAX_DEPTH = 100
"""The deepest nesting of elements: a long chain of bodies in MJCF, each within the last, has fifty."""

MAX_ELEMENTS = 15_000
"""The most elements of a file: the largest robots have some 4,000."""

_NUMBER = re.compile(NUMERAL)

MOST_DIGITS = 400
"""The most characters of a number: more than any float needs, fewer than are slow to read."""

LARGEST = 1e100
"""The largest number: no robot has it, and its square is still a float."""

TEMPLATE = "this is a template: `xacro FILE > robot.urdf` fills it in"
"""What to do with a file that has macros of ROS in it."""


@dataclass(slots=True)
class Element:
    """An element: its `tag`, attributes, children, the pieces of text in it, and where it begins."""

    tag: str
    attributes: dict[str, str]
    source: str
    line: int
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

    @property
    def text(self) -> str:
        """The text in the element, and not in its children."""
        return "".join(self.pieces).strip()

    def find(self, tag: str) -> Element | None:
        """The first child of this tag."""
        return next(self.all(tag), None)

    def all(self, *tags: str) -> Iterator[Element]:
        """The children of these tags."""
        return (child for child in self.children if child.tag in tags)

    def below(self) -> Iterator[Element]:
        """The element and all that it contains, at any depth, in the order of the file."""
        yield self
        for child in self.children:
            yield from child.below()

    def is_true(self, attribute: str) -> bool:
        """Whether an attribute says yes."""
        return self.attributes.get(attribute, "").strip() in ("true", "1")

    def value(self, key: str) -> str | None:
        """The text under a key: of an attribute, as in URDF and MJCF, or in a child, as in SDF."""
        child = self.find(key)
        return self.attributes.get(key, None if child is None else child.text or None)

    def numbers(self, key: str, count: int, default: str | None = None) -> list[Any]:
        """The `count` numbers under a key, digit by digit; without it those of the `default`.

        Raises DocumentError for anything else than numbers that are separated by blanks.
        """
        text, expected = self.value(key), "a number" if count == 1 else f"{count} numbers"
        text = default if text is None else text
        if text is None:
            raise self.refusal(f"`<{self.tag}>` has no `{key}`, expected {expected}")
        words = text.split()
        bad = [word for word in words if len(word) > MOST_DIGITS or _NUMBER.fullmatch(word) is None]
        large = [word for word in words if not bad and abs(float(word)) > LARGEST]
        if not bad and not large and len(words) == count:
            return [Decimal(word) for word in words]
        hint = None
        if "${" in text or "$(" in text:
            hint = TEMPLATE
        elif bad and "," in text:
            hint = "numbers are separated by blanks, and the sign in a decimal is a point"
        elif large:
            hint = f"no number of a robot is larger than {LARGEST:g}"
        message = f"`{key}` of `<{self.tag}>`: read {shown(text)}, expected {expected}"
        raise (self.find(key) or self).refusal(message, hint)

    def refusal(self, message: str, hint: str | None = None) -> DocumentError:
        """The refusal of the file for a problem at the line of the element."""
        return DocumentError([Problem(self.source, message, self.line, hint=hint)])


def read_elements(text: str, source: str) -> Element:
    """The root of the elements in `text`. Raises DocumentError for bad syntax and for what is not safe."""
    root = Element("", {}, source, 1)
    way, count = [root], 0
    # The text is UTF-8 whatever its first line says, which spoke of the file that it was read from.
    parser = expat.ParserCreate("utf-8")
    parser.buffer_text = True

    def start(tag: str, attributes: dict[str, str]) -> None:
        nonlocal count
        element = Element(tag, attributes, source, parser.CurrentLineNumber)
        count += 1
        if count > MAX_ELEMENTS:
            raise element.refusal(f"more than {MAX_ELEMENTS:,} elements")
        if len(way) > MAX_DEPTH:
            raise element.refusal(f"nested more than {MAX_DEPTH} deep")
        way[-1].children.append(element)
        way.append(element)

    def end(tag: str) -> None:
        way.pop()

    def characters(text: str) -> None:
        way[-1].pieces.append(text)

    def doctype(name: str, *where: object) -> None:
        hint = "leave out `<!DOCTYPE ...>` with all that it defines"
        message = f"read the document type {shown(name)}, expected none: it may define entities"
        raise DocumentError([Problem(source, message, parser.CurrentLineNumber, hint=hint)])

    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.CharacterDataHandler, parser.StartDoctypeDeclHandler = characters, doctype
    try:
        parser.Parse(text.encode(errors="surrogatepass"), True)
    except expat.ExpatError as error:
        words = expat.errors.messages[error.code]
        hint = None
        if words == expat.errors.XML_ERROR_MISPLACED_XML_PI:
            hint = "`<?xml ...?>` stands at the very beginning of a file, before comments and blanks"
        message = f"not XML: {words} in column {error.offset + 1}"
        raise DocumentError([Problem(source, message, error.lineno, hint=hint)]) from None
    return root.children[0]  # expat refuses a text without an element
