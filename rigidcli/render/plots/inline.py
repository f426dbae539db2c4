"""Pictures as a part of a page: SVG whose style and names stay its own."""

from __future__ import annotations

import re
from xml.etree import ElementTree as ET
from zlib import crc32

_SVG = "{http://www.w3.org/2000/svg}"
_LINK = "{http://www.w3.org/1999/xlink}href"
_REFERENCE = re.compile(r"#([A-Za-z][\w.-]*)")
"""What refers to another part of the same picture, in a link or in `url(#name)`."""

_FONT = re.compile(r"font-family: ('[^',]*')(?!,)")
"""A font without any other to take its place where it is missing."""


def inline(svg: bytes, label: str, prefix: str) -> str:
    """A picture that matplotlib has drawn, as an element of HTML with a `label` for those who cannot see it.

    The names in it begin with `prefix`, so that pictures on one page do not use parts of each other; without
    one, as on pages of someone else, with a sum over the picture. What would hold for the whole page, its
    style, is left out, and so are names that nothing refers to.
    """
    prefix = prefix or f"picture-{crc32(svg):08x}"
    root = ET.fromstring(svg)  # noqa: S314 - matplotlib has written it a moment ago
    for parent in root.iter():
        for child in list(parent):
            if child.tag in (f"{_SVG}metadata", f"{_SVG}style"):
                parent.remove(child)
    used = {name for node in root.iter() for text in _references(node) for name in _REFERENCE.findall(text)}
    for node in root.iter():
        node.tag = node.tag.removeprefix(_SVG)
        node.text = node.text if (node.text or "").strip() else None
        node.tail = node.tail if (node.tail or "").strip() else None
        if node.get("id") in used:
            node.set("id", f"{prefix}-{node.get('id')}")
        else:
            node.attrib.pop("id", None)
        if link := node.attrib.pop(_LINK, None):
            node.set("href", _REFERENCE.sub(rf"#{prefix}-\1", link))
        if clip := node.get("clip-path"):
            node.set("clip-path", _REFERENCE.sub(rf"#{prefix}-\1", clip))
        if style := node.get("style"):
            node.set("style", _FONT.sub(r"font-family: \1, sans-serif", style))
    root.attrib |= {"role": "img", "aria-label": label}
    return ET.tostring(root, encoding="unicode")


def _references(node: ET.Element) -> tuple[str, str]:
    return node.get(_LINK, ""), node.get("clip-path", "")
