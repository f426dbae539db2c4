"""A reader of pages that forgives nothing, where browsers forgive all."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = {"br", "img", "input", "meta", "wbr"}
"""Elements of pages that have no end."""

OUTSIDE = re.compile(r"//|^\s*(?:javascript|data|vbscript):", re.IGNORECASE)
"""What in an attribute leads out of the page, or runs."""


@dataclass
class Element:
    """An element; its text is that of those in it, too, in their order."""

    tag: str
    attributes: dict[str, str]
    text: str = ""
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> list[Element]:
        """The elements of that name in this one."""
        inner = [found for child in self.children for found in child.all(tag)]
        return [self, *inner] if self.tag == tag else inner


class _Reader(HTMLParser):
    """Raises AssertionError for a tag that is not closed, or closed out of turn."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.root = Element("", {})
        self.open = [self.root]
        self.names: set[str] = set()
        self.targets: set[str] = set()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        attributes = {name: value or "" for name, value in attrs}
        assert len(attributes) == len(attrs), f"an attribute twice in <{tag}>"
        for name, value in attributes.items():
            assert not name.startswith("on"), f"{name} in <{tag}>"
            is_picture = (tag, name) == ("img", "src") and value.startswith("data:image/svg+xml,")
            assert is_picture or not OUTSIDE.search(value), f"{name}={value} in <{tag}>"
        if identity := attributes.get("id"):
            assert identity not in self.names, f"two elements are called {identity}"
            self.names.add(identity)
        self.targets.update(re.findall(r"#([\w.-]+)", attributes.get("href", "")))
        element = Element(tag, attributes)
        self.open[-1].children.append(element)
        if tag not in VOID:
            self.open.append(element)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        inside = {element.tag for element in self.open}
        assert inside & {"svg", "math"}, f"<{tag}/> is not closed in HTML"
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open[-1].tag == tag, f"</{tag}> where <{self.open[-1].tag}> is open"
        self.open.pop()

    def handle_data(self, data: str) -> None:
        for element in self.open:
            element.text += data


def markup(text: str) -> Element:
    """A page or a part of one, of which every tag is closed in its turn, and nothing leads outside."""
    reader = _Reader()
    reader.feed(text)
    reader.close()
    assert len(reader.open) == 1, f"<{reader.open[-1].tag}> is never closed"
    assert reader.targets <= reader.names, "a reference to nothing"
    return reader.root
