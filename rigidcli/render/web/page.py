"""The frame of every page: a head with the style, which needs no network, and the body."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from html import escape
from pathlib import Path

from rigidcli.errors import printable

# The Content Security Policy of a page: it may use what stands in it, and load nothing.
_POLICY = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'; img-src data:"


def page(
    title: str, body: Iterable[str], scripts: Iterable[str] = (), styles: Iterable[str] = ()
) -> Iterator[str]:
    """A whole page, piece by piece, from a title in plain text, a body, scripts and styles."""
    yield (
        "<!DOCTYPE html>\n"
        '<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta http-equiv="Content-Security-Policy" content="{_POLICY}">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{text(title)}</title>\n<style>\n{resource('page.css')}{''.join(styles)}</style>\n</head>\n<body>\n"
    )
    yield from body
    yield from map(script_element, scripts)
    yield "</body>\n</html>\n"


def script_element(script: str) -> str:
    """The element of a script of ours, which ends no element itself."""
    return f"<script>\n{script}</script>\n"


def script_of(*names: str) -> str:
    """Scripts of this package as one, without comments, whose names are its own."""
    lines = (line.strip() for name in names for line in resource(name).splitlines())
    script = "".join(f"{line}\n" for line in lines if line and not line.startswith("//"))
    return f'(() => {{\n"use strict";\n{script}}})();\n'


def text(words: str) -> str:
    """Words of a document or an answer, which stay text in HTML, also between quotation marks."""
    return escape(printable(words))


def resource(name: str) -> str:
    """A style sheet or script of this package."""
    return (Path(__file__).parent / name).read_text("utf-8")
