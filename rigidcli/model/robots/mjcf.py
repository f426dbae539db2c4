"""Robots in MJCF, of MuJoCo: the bodies whose `<inertial>` says what they weigh.

The tensor of an `<inertial>` is about its `pos`, the centre of mass in the frame of the body:
`diaginertia` along axes that are turned, `fullinertia` along those of the body, entries M11 M22 M33 M12 M13
M23, off the diagonal -sum m x y. A body without it has the mass and tensor of its geoms, which are added up
as MuJoCo does, whether they overlap or not; but not where meshes are among them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rigidcli.errors import shown
from rigidcli.model.robots import LISTED
from rigidcli.model.robots.elements import MAX_DEPTH, MAX_ELEMENTS, Element, read_elements
from rigidcli.model.robots.geoms import OUTERMOST, Defaults, completed, defaults, form
from rigidcli.model.robots.links import (
    NO_MASS,
    Body,
    Decimals,
    Link,
    Robot,
    described,
    framed,
    geometries,
    numbers,
    tensor,
)
from rigidcli.model.robots.orientation import Angles, frame_of, is_turned
from rigidcli.model.texts import read_text

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

BY_OTHER_RULES = ("inertiagrouprange", SHELL)
"""Settings of `<compiler>` with which geoms are not all added up as solids."""

CHANGING = ("settotalmass", "boundmass", "boundinertia", "balanceinertia")
"""Settings of `<compiler>` by which MuJoCo takes other masses and tensors than the file says."""

FRAMES = ("frame", "replicate")
"""Elements that move what is in them."""

MOST_FRAMES = 10
"""The most frames about a part of a body, each in the next: each is one more composite of a document."""


@dataclass(frozen=True, slots=True)
class _Reading:
    """What holds for all bodies: how numbers and angles are read, the defaults of geoms, and of masses.

    Of `infers`, `true` takes all masses from geoms, `false` none; `is_plain` where geoms count as solids.
    """

    decimal: Decimals
    angles: Angles
    defaults: Mapping[str, Defaults]
    infers: str
    is_plain: bool


def read(root: Element, folder: Path, decimal: Decimals) -> Robot:
    """The bodies, without the world."""
    _include(root, folder)
    compiler = {key: value for element in root.all("compiler") for key, value in element.attributes.items()}
    angles = Angles(compiler.get("angle", "degree") != "radian", compiler.get("eulerseq", "xyz"))
    infers = compiler.get("inertiafromgeom", "auto")
    is_plain = not any(compiler.get(key, "false") != "false" for key in BY_OTHER_RULES)
    reading = _Reading(decimal, angles, defaults(root), infers, is_plain)
    notes = [
        f'MuJoCo changes what is written by `{key}="{compiler[key][:20]}"`'
        for key in CHANGING
        if compiler.get(key, "false").strip() not in ("", "false", "0", "-1")
    ]
    links = [
        _link(body, style, reading)
        for world in root.all("worldbody")
        for body, style in _bodies(world, OUTERMOST)
    ]
    repeated = next((element.line for element in _below(root) if element.tag == "replicate"), None)
    if repeated is not None:
        notes.append(f"of the bodies that `<replicate>` in line {repeated} repeats, one is told")
    inferred = [link.name for link in links if link.inertial is not None and "parts" in link.inertial]
    if inferred:
        names = ", ".join(inferred[:LISTED]) + (" ..." if len(inferred) > LISTED else "")
        taken = f"with {DENSITY} kg/m^3 where none is given"
        notes.append(
            f"mass and tensor are those of the geoms, {taken}, of links without `<inertial>`: {names}"
        )
    return Robot(links, notes)


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
        found = list(_parts(body, "inertial", style, reading))
        if not found or (reading.infers == "true" and geoms):
            if not geoms or reading.infers == "false":
                return NO_MASS
            repeated = any(_parts(body, "replicate", style, reading))
            parts = None if repeated else _solids(geoms, reading)
            if parts is None:
                return INFERRED
            return ({"parts": parts}, {"inertia": body.line}) if parts else NO_MASS
        element, _, frames = found[0]
        bare = replace(bare, frames=frames)
        return _inertial(element, reading), dict.fromkeys(("mass", "inertia", "position"), element.line)

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
    if len(geoms) > MOST_GEOMS or not reading.is_plain:
        return None
    parts: list[Body] = []
    for geom, style, frames in geoms:
        whole = _completed(geom, style, reading)
        key = "mass" if "mass" in whole.attributes else "density"
        (value,) = numbers(whole, key, 1, reading.decimal, DENSITY)
        if value == 0 or whole.attributes.get("type") in MASSLESS:
            continue
        body = form(whole, reading.angles, reading.decimal)
        if body is None or whole.attributes.get(SHELL, "false") != "false":
            return None
        del body["density"]
        parts.append(framed(body | {key: value}, frames))
    return parts
