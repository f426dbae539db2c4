"""Robots in MJCF, of MuJoCo: the bodies whose `<inertial>` says what they weigh.

The tensor of an `<inertial>` is about its `pos`, the centre of mass in the frame of the body:
`diaginertia` along axes that are turned, `fullinertia` along those of the body, entries M11 M22 M33 M12 M13
M23, off the diagonal -sum m x y. A body without it has the mass and tensor of its geoms, which are added up
as MuJoCo does, whether they overlap or not; but not where meshes are among them.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rigidcli.bodies.robots.compiler import Compiler
from rigidcli.bodies.robots.elements import MAX_DEPTH, MAX_ELEMENTS, Element, read_elements
from rigidcli.bodies.robots.geoms import OUTERMOST, Defaults, completed, defaults, form
from rigidcli.bodies.robots.links import (
    NO_MASS,
    Body,
    Decimals,
    Link,
    Robot,
    described,
    framed,
    geometries,
    listed,
    numbers,
    tensor,
)
from rigidcli.bodies.robots.orientation import Angles, frame_of, is_turned
from rigidcli.errors import shown
from rigidcli.fields.texts import read_text

ROOT = "mujoco"
"""The tag of the root."""

INCLUDED = "mujocoinclude"
"""The tag of the root of a file that others include; `ROOT` may stand there, too."""

INFERRED = "no `<inertial>`: MuJoCo infers it from geoms that are not all plain solids"
"""Why a body has no mass properties here; where it has no geoms, it has no mass."""

DENSITY = "1000"
"""The density (kg/m^3) that MuJoCo takes for a geom of which neither mass nor density is given."""

MOST_GEOMS = 200
"""The most geoms that are added up, which take a fifth of a second."""

MASSLESS = ("plane", "hfield")
"""The types of geoms that have no volume."""

SHELL = "shellinertia"
"""The attribute of geoms, once a setting of `<compiler>`, that are thin shells."""

ALL_GROUPS = "0 5"
"""The groups of geoms that are added up."""

REPEATING = ("attach", "composite", "flexcomp", "replicate")
"""Elements from which MuJoCo makes bodies that are not written in the file."""

FRAMES = ("frame", "replicate")
"""Elements that move what is in them."""

MOST_FRAMES = 10
"""The most frames about a part of a body, each in the next: each is one more composite of a document."""


@dataclass(frozen=True, slots=True)
class _Reading:
    """What holds for all bodies: how numbers and angles are read, the defaults of geoms, and of masses.

    Of `infers`, `true` takes all masses from geoms, `false` none. Geoms count that are in one of the `groups`
    from the first to the last, and are solids, unless all are shells.
    """

    decimal: Decimals
    angles: Angles
    defaults: Mapping[str, Defaults]
    infers: str
    groups: Sequence[float]
    are_shells: bool
    compiler: Compiler


def read(root: Element, folder: Path, decimal: Decimals) -> Robot:
    """The bodies, without the world."""
    _include(root, folder)
    compiler = Element("compiler", {}, root.source, root.line)
    for element in root.all("compiler"):
        compiler = replace(element, attributes=compiler.attributes | element.attributes)
    given = compiler.attributes
    reading = _Reading(
        decimal,
        Angles(given.get("angle", "degree") != "radian", given.get("eulerseq", "xyz")),
        defaults(root),
        given.get("inertiafromgeom", "auto"),
        numbers(compiler, "inertiagrouprange", 2, float, ALL_GROUPS),
        given.get(SHELL, "false") != "false",
        Compiler.of(compiler, decimal),
    )
    names: Counter[str] = Counter()
    links = []
    for world in root.all("worldbody"):
        for body, style in _bodies(world, OUTERMOST):
            link = _link(body, style, reading)
            names[link.name] += 1
            if "name" not in body.attributes and names[link.name] > 1:
                link = replace(link, name=f"{link.name}, number {names[link.name]}")
            links.append(link)
    makers = [
        f"`<{element.tag}>` in line {element.line}" for element in _below(root) if element.tag in REPEATING
    ]
    found, notes = reading.compiler.scaled(links, makers)
    notes += [f"bodies that {maker} makes besides those that are written are not told" for maker in makers]
    inferred = [link.name for link in links if link.inertial is not None and "mass" not in link.lines]
    if inferred:
        taken = f"with {DENSITY} kg/m^3 where none is given"
        notes.append(
            f"mass and tensor are those of the geoms, {taken}, of links without `<inertial>`: "
            f"{listed(inferred)}"
        )
    return Robot(found, notes)


def _below(element: Element) -> Iterator[Element]:
    yield element
    for child in element.children:
        yield from _below(child)


def _include(root: Element, folder: Path) -> None:
    """Put the content of other files, below the folder, in the place of each `<include>`.

    Raises DocumentError for a file that cannot be read, and for one that is included twice, as MuJoCo does.
    """
    seen: set[Path] = set()
    count = 0

    def content(include: Element) -> Element:
        nonlocal count
        name = include.attributes.get("file", "")
        try:
            path = (folder / name).resolve()
        except (OSError, ValueError):
            raise include.refusal("no file has the name that `<include>` gives") from None
        if not path.is_relative_to(folder.resolve()):
            raise include.refusal("`<include>` names a file outside the robot's folder, which is not read")
        if path in seen:
            raise include.refusal("this file is included twice")
        seen.add(path)
        source = str(folder / name)
        included = read_elements(read_text(source, source), source)
        if included.tag not in (ROOT, INCLUDED):
            raise included.refusal(f"read `<{included.tag[:40]}>`, expected `<{INCLUDED}>`")
        count += sum(1 for _ in _below(included))
        if count > MAX_ELEMENTS:
            raise include.refusal(f"more than {MAX_ELEMENTS:,} elements in all files together")
        return included

    def expand(element: Element, depth: int) -> None:
        if depth > MAX_DEPTH:
            raise element.refusal(f"nested more than {MAX_DEPTH} deep")
        children, element.children = element.children, []
        for child in children:
            whole = content(child) if child.tag == "include" else child
            expand(whole, depth + 1)
            element.children += [child] if whole is child else whole.children

    expand(root, 1)


def _bodies(parent: Element, style: str) -> Iterator[tuple[Element, str]]:
    """The bodies below an element, each with the class of defaults that holds in it."""
    for child in parent.all("body", *FRAMES):
        own = child.attributes.get("childclass", style)
        if child.tag == "body":
            yield child, own
        yield from _bodies(child, own)


def _parts(
    parent: Element, tag: str, style: str, reading: _Reading
) -> Iterator[tuple[Element, str, Sequence[Body]]]:
    """The elements of a tag in a body, with the class of defaults and the frames about each."""
    for child in parent.children:
        if child.tag == tag:
            yield child, style, ()
        elif child.tag in FRAMES:
            own = child.attributes.get("childclass", style)
            for found, its_style, frames in _parts(child, tag, own, reading):
                if len(frames) == MOST_FRAMES:
                    raise found.refusal(f"in more than {MOST_FRAMES} frames, one in the other")
                yield found, its_style, (*frames, frame_of(child, reading.angles, reading.decimal))


def _link(body: Element, style: str, reading: _Reading) -> Link:
    bare = Link(body.attributes.get("name") or f"body in line {body.line}", body.source, body.line)

    def read() -> tuple[Body, Mapping[str, int]] | str:
        nonlocal bare
        geoms = list(_parts(body, "geom", style, reading))
        about = {id(geom): (own, frames) for geom, own, frames in geoms}
        forms = geometries([geom for geom, *_ in geoms], lambda geom: _form(geom, *about[id(geom)], reading))
        bare = replace(bare, geometry=forms)
        blocks = list(_parts(body, "inertial", style, reading))
        found: Body | str
        if blocks and not (reading.infers == "true" and geoms):
            element, _, frames = blocks[0]
            bare = replace(bare, frames=frames)
            found = _inertial(element, reading)
            lines = dict.fromkeys(("mass", "inertia", "position"), element.line)
        else:
            repeated = any(_parts(body, "replicate", style, reading))
            inferred = reading.infers != "false"
            parts = None if repeated else _solids(geoms, reading) if inferred else []
            found = INFERRED if parts is None else {"parts": parts} if parts else NO_MASS
            lines = {"inertia": body.line}
        found = reading.compiler.bounded(found, bare.name)
        return found if isinstance(found, str) else (found, lines)

    link = described(bare, read)
    return replace(link, geometry=bare.geometry, frames=bare.frames)


def _inertial(element: Element, reading: _Reading) -> Body:
    """The body of an `<inertial>`."""
    read = reading.decimal
    numbers(element, "pos", 3, read)
    (mass,) = numbers(element, "mass", 1, read)
    frame = frame_of(element, reading.angles, read)
    given = [key for key in ("diaginertia", "fullinertia") if key in element.attributes]
    if len(given) != 1:
        message = "expected one of `diaginertia` and `fullinertia`"
        raise element.refusal(f"{message}, read {'both' if given else 'none of them'}")
    if given == ["diaginertia"]:
        x, y, z = numbers(element, "diaginertia", 3, read)
        return {"mass": mass, "inertia": {"Ixx": x, "Iyy": y, "Izz": z}, **frame}
    if is_turned(element):
        raise element.refusal(
            "`fullinertia` is along the axes of the body, expected no orientation beside it"
        )
    xx, yy, zz, xy, xz, yz = numbers(element, "fullinertia", 6, read)
    return {"mass": mass, "inertia": tensor([xx, xy, xz, yy, yz, zz]), **frame}


def _completed(geom: Element, style: str, reading: _Reading) -> Element:
    """A geom with the defaults of its class."""
    name = geom.attributes.get("class", style)
    if name not in reading.defaults and name != OUTERMOST:
        raise geom.refusal(f"read the class {shown(name)}, expected one that a `<default>` has")
    return replace(geom, attributes=completed(geom.attributes, reading.defaults.get(name, {})))


def _form(geom: Element, style: str, frames: Sequence[Body], reading: _Reading) -> Body | None:
    """The geometry of a geom, completed by its defaults."""
    body = form(_completed(geom, style, reading), reading.angles, reading.decimal)
    return body and framed(body, frames)


def _solids(geoms: Sequence[tuple[Element, str, Sequence[Body]]], reading: _Reading) -> list[Body] | None:
    """What the geoms of a body weigh, as parts of a composite; None where that is not known here."""
    if len(geoms) > MOST_GEOMS:
        return None
    first, last = reading.groups
    parts: list[Body] = []
    for geom, style, frames in geoms:
        whole = _completed(geom, style, reading)
        key = "mass" if "mass" in whole.attributes else "density"
        (value,) = numbers(whole, key, 1, reading.decimal, DENSITY)
        (group,) = numbers(whole, "group", 1, float, "0")
        is_counted = first <= group <= last and whole.attributes.get("type") not in MASSLESS
        if value == 0 or not is_counted:
            continue
        body = form(whole, reading.angles, reading.decimal)
        if body is None or reading.are_shells or whole.attributes.get(SHELL, "false") != "false":
            return None
        del body["density"]
        parts.append(framed(body | {key: value}, frames))
    return parts
