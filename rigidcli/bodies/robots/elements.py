"""XML -> elements with their lines, by expat of the standard library; nothing outside the text is read.

A document type is refused as soon as it begins, and with it every entity that a file may define: those that
grow without bound as well as those that name other files. Depth and count are bounded here, the size of a
text where it is read.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from rigidcli.errors import DocumentError, Problem, shown

MAX_DEPTH = 100
"""The deepest nesting of elements: a long chain of bodies in MJCF, each within the last, has fifty."""

MAX_ELEMENTS = 15_000
"""The most elements of a file: the largest robots have some 4,000."""


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
        return "".join(self.pieces)

    def find(self, tag: str) -> Element | None:
        """The first child of this tag."""
        return next(self.all(tag), None)

    def all(self, *tags: str) -> Iterator[Element]:
        """The children of these tags."""
        return (child for child in self.children if child.tag in tags)

    def problem(self, message: str, key: str = "", hint: str | None = None) -> Problem:
        """A problem at the line of the element."""
        return Problem(self.source, message, self.line, key, hint)

    def refusal(self, message: str, key: str = "", hint: str | None = None) -> DocumentError:
        """The refusal of the file for a problem at the line of the element."""
        return DocumentError([self.problem(message, key, hint)])


def read_elements(text: str, source: str) -> Element:
    """The root of the elements in `text`. Raises DocumentError for bad syntax and for what is not safe."""
    builder = _Builder(source)
    try:
        builder.parser.Parse(text.encode(errors="surrogatepass"), True)
    except expat.ExpatError as error:
        words = expat.errors.messages[error.code]
        hint = None
        if words == expat.errors.XML_ERROR_MISPLACED_XML_PI:
            hint = "`<?xml ...?>` stands at the very beginning of a file, before comments and blanks"
        raise DocumentError(
            [Problem(source, f"not XML: {words} in column {error.offset + 1}", error.lineno, hint=hint)]
        ) from None
    assert builder.root is not None  # expat refuses a text without an element
    return builder.root


class _Builder:
    """Puts the events of expat together."""

    def __init__(self, source: str) -> None:
        self.root: Element | None = None
        self._source = source
        self._open: list[Element] = []
        self._count = 0
        # The text is UTF-8 whatever its first line says, which spoke of the file that it was read from.
        self.parser = expat.ParserCreate("utf-8")
        self.parser.buffer_text = True
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        self.parser.StartDoctypeDeclHandler = self._doctype

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        element = Element(tag, attributes, self._source, self.parser.CurrentLineNumber)
        self._count += 1
        if self._count > MAX_ELEMENTS:
            raise element.refusal(f"more than {MAX_ELEMENTS:,} elements")
        if len(self._open) == MAX_DEPTH:
            raise element.refusal(f"nested more than {MAX_DEPTH} deep")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)

    def _end(self, tag: str) -> None:
        self._open.pop()

    def _characters(self, text: str) -> None:
        if self._open:
            self._open[-1].pieces.append(text)

    def _doctype(self, name: str, *where: object) -> None:
        hint = "leave out `<!DOCTYPE ...>` with all that it defines"
        message = f"read the document type {shown(name)}, expected none: it may define entities"
        raise DocumentError([Problem(self._source, message, self.parser.CurrentLineNumber, hint=hint)])
