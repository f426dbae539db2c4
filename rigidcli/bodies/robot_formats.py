"""Robots in URDF, of ROS, in SDF, of Gazebo, and in MJCF, of MuJoCo: XML -> elements -> links.

The tensor of an `<inertial>` is about the centre of mass, which is the origin of its frame, along the axes
of that frame; products of inertia are entries of the tensor, -sum m x y. `<origin>` in URDF and `<pose>` in
SDF have a position, and roll, pitch and yaw about fixed axes. In SDF values stand in elements. In MJCF there
is `diaginertia` along axes that are turned, or `fullinertia` along those of the body, M11 M22 M33 M12 M13
M23. What MuJoCo infers or changes is not worked out here: a body without an `<inertial>` has no result, and a
file that lets MuJoCo change what is written is refused.

A document type is refused as soon as it begins, and with it every entity that a file may define: those that
grow without bound as well as those that name other files. Depth and count are bounded here, the size of a
text where it is read.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import lru_cache, partial
from pathlib import Path
from typing import Any, ClassVar
from xml.parsers import expat

import numpy as np

from rigidcli.bodies.robots import ENTRIES, NO_MASS, Body, GeometryPart, Link, Robot, Weight
from rigidcli.errors import DocumentError, Problem, ValueProblem, first_few, shortened, shown
from rigidcli.fields.texts import read_text
from rigidcli.language.numerals import NUMERAL

# The deepest nesting of elements: a long chain of bodies in MJCF, each within the last, has fifty.
DEEPEST_ELEMENT = 100
MAX_ELEMENTS = 15_000  # the most elements of a file: the largest robots have some 4,000
# The most characters of a number, and the largest one: its square is still a float.
MOST_DIGITS, LARGEST_NUMBER = 400, 1e100

_NUMBER = re.compile(NUMERAL)

# What to do with a file that has macros of ROS in it.
TEMPLATE = "this is a template: `xacro FILE > robot.urdf` fills it in"


@dataclass(slots=True)
class Element:
    """An element: its `tag`, attributes, children, the pieces of text in it, and where it begins."""

    tag: str
    attributes: dict[str, str]
    source: str
    line: int
    children: list[Element] = field(default_factory=list)
    pieces: list[str] = field(default_factory=list)

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
        return self.attributes.get(key, None if child is None else "".join(child.pieces).strip() or None)

    def numbers(self, key: str, count: int, default: str | None = None) -> list[Any]:
        """The `count` numbers under a key, or of the `default`. Raises DocumentError for other texts."""
        text, expected = self.value(key), "a number" if count == 1 else f"{count} numbers"
        text = default if text is None else text
        if text is None:
            raise self.refusal(f"`<{self.tag}>` has no `{key}`, expected {expected}")
        words = text.split()
        bad = any(len(word) > MOST_DIGITS or _NUMBER.fullmatch(word) is None for word in words)
        large = not bad and any(abs(float(word)) > LARGEST_NUMBER for word in words)
        if not bad and not large and len(words) == count:
            return [Decimal(word) for word in words]
        hint = None
        if "${" in text or "$(" in text:
            hint = TEMPLATE
        elif bad and "," in text:
            hint = "numbers are separated by blanks, and the sign in a decimal is a point"
        elif large:
            hint = f"no number of a robot is larger than {LARGEST_NUMBER:g}"
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
        if len(way) > DEEPEST_ELEMENT:
            raise element.refusal(f"nested more than {DEEPEST_ELEMENT} deep")
        way[-1].children.append(element)
        way.append(element)

    def doctype(name: str, *where: object) -> None:
        message = f"read the document type {shown(name)}, expected none: it may define entities"
        hint = "leave out `<!DOCTYPE ...>` with all that it defines"
        raise Element("", {}, source, parser.CurrentLineNumber).refusal(message, hint)

    parser.StartElementHandler, parser.StartDoctypeDeclHandler = start, doctype
    parser.EndElementHandler = lambda tag: way.pop()
    parser.CharacterDataHandler = lambda text: way[-1].pieces.append(text)
    try:
        parser.Parse(text.encode(errors="surrogatepass"), True)
    except expat.ExpatError as error:
        words, hint = expat.errors.messages[error.code], None
        if words == expat.errors.XML_ERROR_MISPLACED_XML_PI:
            hint = "`<?xml ...?>` stands at the very beginning of a file, before comments and blanks"
        message = f"not XML: {words} in column {error.offset + 1}"
        raise Element("", {}, source, error.lineno).refusal(message, hint) from None
    return root.children[0]  # expat refuses a text without an element


def _placed(position: Sequence[Any], **turn: Any) -> Body:
    """A frame at a position, with the `rotation` or `axis` that turns it; nothing where it does not move."""
    return {"position": list(position), **turn} if any(position) else turn


def _turned(roll_pitch_yaw: Sequence[Any], unit: str = "") -> Body:
    return {"rotation": {"rpy": _angles(roll_pitch_yaw, unit)}} if any(roll_pitch_yaw) else {}


def _angles(values: Sequence[Any], unit: str) -> list[Any]:
    return [f"{value} {unit}" if unit else value for value in values]


# --- URDF


def read_urdf(root: Element, folder: Path) -> Robot:
    """The links of the robot. Macros are not filled in, which is noted."""
    macro = next((child for child in root.children if child.tag.startswith("xacro:")), None)
    notes = [] if macro is None else [f"`<{macro.tag[:40]}>` in line {macro.line}: {TEMPLATE}"]
    urdf = _Urdf(folder)
    return Robot([urdf.link(link, link.attributes.get("name", "")) for link in root.all("link")], notes)


@dataclass(frozen=True)
class _Urdf:
    """How the parts of a link are written; files of meshes are below a `folder`.

    `PLACE` is the tag of a frame, and `NOTHING` the reason why a link without `<inertial>` has no mass.
    """

    PLACE: ClassVar = "origin"
    NOTHING: ClassVar = NO_MASS

    folder: Path

    def frame(self, part: Element, link: Element) -> Body:
        origin = part.find("origin")
        if origin is None:
            return {}
        return _placed(origin.numbers("xyz", 3, "0 0 0"), **_turned(origin.numbers("rpy", 3, "0 0 0")))

    def mass(self, inertial: Element) -> Any:
        mass = inertial.find("mass")
        return 0 if mass is None else mass.numbers("value", 1)[0]

    def moments(self, inertial: Element) -> list[Any]:
        entries = inertial.find("inertia")
        if entries is None:
            raise inertial.refusal("there is a mass and no `<inertia>`, expected its tensor")
        moments = [entries.numbers(key.lower(), 1)[0] for key in ENTRIES]
        for key, number in zip(ENTRIES, moments, strict=True):
            other = f"i{key[2]}{key[1]}"
            if entries.numbers(other, 1, str(number))[0] != number:
                read = f"`{key.lower()}` is {number} and `{other}` is {entries.value(other)}"
                raise entries.refusal(f"{read}, expected one number, as a tensor is symmetric")
        return moments

    def weight(self, link: Element) -> Weight:
        inertial = link.find("inertial")
        if inertial is None:
            return {"without": self.NOTHING}
        mass, frame = self.mass(inertial), self.frame(inertial, link)
        if not mass:
            return {"without": NO_MASS}
        places = {"mass": "mass", "inertia": "inertia", "position": self.PLACE, "rotation": self.PLACE}
        elements = {key: inertial.find(tag) for key, tag in places.items()}
        lines = {key: element.line for key, element in elements.items() if element is not None}
        inertia = dict(zip(ENTRIES, self.moments(inertial), strict=True))
        return {"body": {"mass": mass, "inertia": inertia, **frame}, "lines": lines}

    def link(self, element: Element, name: str) -> Link:
        geometry = list[GeometryPart]()
        with suppress(DocumentError, OSError, ValueError):  # one part is not known, or no file has its name
            geometry = [self._part(part, element) for part in element.all("visual", "collision")]
        link = Link(name, element.source, element.line, geometry=geometry)
        return link.weighed(lambda: self.weight(element))

    def _part(self, part: Element, link: Element) -> GeometryPart:
        """A part of the geometry. Raises DocumentError where it is not known how large it is."""
        frame, geometry = self.frame(part, link), part.find("geometry")
        for form in () if geometry is None else geometry.children:
            match form.tag:
                case "box":
                    return GeometryPart(frame, [size / 2 for size in form.numbers("size", 3)])
                case "sphere":
                    return GeometryPart(frame, form.numbers("radius", 1) * 3)
                case "cylinder":
                    (radius,), (length,) = form.numbers("radius", 1), form.numbers("length", 1)
                    return GeometryPart(frame, [radius, radius, length / 2])
                case "mesh":
                    name = form.value("filename") or form.value("uri") or ""
                    return GeometryPart(frame, form.numbers("scale", 3, "1 1 1"), self._found(name))
        raise part.refusal("no geometry of a known form")

    def _found(self, name: str) -> Path:
        """The file of a mesh. `package://` and the like stand for a folder above, or for one in it."""
        scheme, _, rest = name.rpartition("://")
        places = [self.folder, *(self.folder.resolve().parents if scheme else ())]
        names = [rest, *([rest.partition("/")[2]] if scheme else ())]
        return next((p / n for p in places for n in names if (p / n).is_file()), self.folder / rest)


# --- SDF

# The entries of a tensor (kg m^2) that SDF takes where they are not given.
NOT_GIVEN = dict(zip(ENTRIES, "100101", strict=True))


def read_sdf(root: Element, folder: Path) -> Robot:
    """The links of all models; where there are several models, with the names of these before them."""
    elements = list(_in_models(root, (), "link"))
    several, sdf, links = len({scope for scope, _ in elements}) > 1, _Sdf(folder), []
    for scope, element in elements:
        name = element.attributes.get("name", "")
        links.append(sdf.link(element, "::".join([*scope, name]) if name and several else name))
    notes = [f"`<include>` in line {one.line} is not followed" for _, one in _in_models(root, (), "include")]
    notes += [
        f"link {link.name} (line {link.line}) is without `<mass>` or `<inertia>`: 1 kg and 1 kg m^2 are taken"
        for link in links
        if link.body is not None and not {"mass", "inertia"} <= link.lines.keys()
    ]
    return Robot(links, notes)


def _in_models(
    parent: Element, scope: tuple[str, ...], tag: str
) -> Iterator[tuple[tuple[str, ...], Element]]:
    """The elements of this tag in all models, with the names of the models about them."""
    for child in parent.children:
        if child.tag == tag:
            yield scope, child
        elif child.tag == "world":
            yield from _in_models(child, scope, tag)
        elif child.tag == "model":
            yield from _in_models(child, (*scope, child.attributes.get("name", "")), tag)


class _Sdf(_Urdf):
    """The parts of a link in SDF: the same, with the numbers of a frame in one line."""

    PLACE = "pose"
    NOTHING = "no `<inertial>`, for which simulators take 1 kg and 1 kg m^2"

    def frame(self, part: Element, link: Element) -> Body:
        pose = part.find("pose")
        if pose is None:
            return {}
        seen_from = pose.attributes.get("relative_to", pose.attributes.get("frame", ""))  # in older files
        if seen_from not in ("", link.attributes.get("name")):
            raise pose.refusal(f"`relative_to` is {shown(seen_from)}, expected the frame of the link")
        if pose.attributes.get("rotation_format", "euler_rpy") == "quat_xyzw":
            *position, x, y, z, w = part.numbers("pose", 7, "0 0 0 0 0 0 1")
            return _placed(position, rotation={"quaternion": [w, x, y, z]})
        values = part.numbers("pose", 6, "0 0 0 0 0 0")
        return _placed(values[:3], **_turned(values[3:], "deg" if pose.is_true("degrees") else ""))

    def mass(self, inertial: Element) -> Any:
        return inertial.numbers("mass", 1, "1")[0]

    def moments(self, inertial: Element) -> list[Any]:
        entries = inertial.find("inertia") or inertial
        return [entries.numbers(key.lower(), 1, default)[0] for key, default in NOT_GIVEN.items()]

    def weight(self, link: Element) -> Weight:
        inertial = link.find("inertial")
        if inertial is not None and inertial.is_true("auto"):
            return {"without": "no mass that is written: its simulator infers it from the collisions"}
        return super().weight(link)


# --- MJCF

# How to come to a file that is read here. Without that setting MuJoCo 4 saves no `<inertial>` at all.
SAVED = (
    'MuJoCo writes what it made of a file: put `<compiler saveinertial="true"/>` into it, '
    'and run `mujoco.mj_saveLastXML("saved.xml", mujoco.MjModel.from_xml_path(FILE))`'
)

ROUNDED = 1e-12  # the relative error of a principal moment that is worked out from `fullinertia`
# Elements from which MuJoCo makes bodies that are not written in the file.
REPEATING = ("attach", "composite", "flexcomp", "replicate")
# The attributes that turn a frame, and how many numbers each has; at most one of them may stand.
WAYS = {"quat": 4, "axisangle": 4, "euler": 3, "xyaxes": 6, "zaxis": 3}


def read_mjcf(root: Element, folder: Path) -> Robot:
    """The bodies, without the world. Raises DocumentError where MuJoCo changes what is written."""
    compiler, notes = dict[str, str](), list[str]()
    for element in root.below():
        if element.tag == "include":
            raise element.refusal("`<include>` is not read", SAVED)
        if element.tag in REPEATING:
            notes.append(f"bodies that `<{element.tag}>` in line {element.line} makes are left out")
    for element in root.all("compiler"):
        _require_as_written(element, root)
        compiler |= element.attributes
    names, links = Counter[str](), []
    for body in (element for world in root.all("worldbody") for element in world.below()):
        if body.tag == "body":
            name = body.attributes.get("name") or f"body in line {body.line}"
            names[name] += 1
            if "name" not in body.attributes and names[name] > 1:
                name = f"{name}, number {names[name]}"
            links.append(Link(name, body.source, body.line).weighed(partial(_weight, body, compiler)))
    return Robot(links, notes, SAVED)


def _require_as_written(compiler: Element, root: Element) -> None:
    """Raise DocumentError for a setting by which masses and tensors are not as they are written.

    A bound that no `<inertial>` is below changes nothing; MuJoCo keeps it in the files that it saves.
    """
    given = compiler.attributes
    changing = [key for key in ("inertiafromgeom", "balanceinertia") if given.get(key) == "true"]
    if compiler.numbers("settotalmass", 1, "0")[0] > 0:
        changing.append("settotalmass")
    bounds = {key: float(compiler.numbers(key, 1, "0")[0]) for key in ("boundmass", "boundinertia")}
    for element in root.below() if any(bound > 0 for bound in bounds.values()) else ():
        if element.tag == "inertial":
            xx, yy, zz, xy, xz, yz = map(float, _moments(element))
            least = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])[0] * (1 + ROUNDED)
            written = {"boundmass": float(element.numbers("mass", 1)[0]), "boundinertia": least}
            changing += [key for key, bound in bounds.items() if written[key] < bound]
    for key in changing:
        message = f"`{key}` lets MuJoCo change masses and tensors, expected them as they are written"
        raise compiler.refusal(message, SAVED)


def _moments(element: Element) -> list[Any]:
    """M11 M22 M33 M12 M13 M23 of an `<inertial>` (kg m^2). Raises DocumentError."""
    given = [key for key in ("diaginertia", "fullinertia") if key in element.attributes]
    if len(given) != 1:
        message = "expected one of `diaginertia` and `fullinertia`"
        raise element.refusal(f"{message}, read {'both' if given else 'none of them'}")
    if given == ["diaginertia"]:
        return [*element.numbers("diaginertia", 3), 0, 0, 0]
    if element.attributes.keys() & WAYS:
        message = "`fullinertia` is along the axes of the body, expected no orientation beside it"
        raise element.refusal(message)
    return element.numbers("fullinertia", 6)


def _weight(body: Element, compiler: Mapping[str, str]) -> Weight:
    element = body.find("inertial")
    for other in body.all("frame") if element is None else ():
        if other.find("inertial") is not None:
            message = "an `<inertial>` in a `<frame>` is not read, expected it in the body itself"
            raise other.refusal(message, SAVED)
    if element is None:
        reason = "no `<inertial>`: MuJoCo infers mass and tensor from the geoms, if there are any"
        return {"without": reason}
    (mass,) = element.numbers("mass", 1)
    if not mass:
        return {"without": NO_MASS}
    frame = _placed(element.numbers("pos", 3), **_turn(element, compiler))
    xx, yy, zz, xy, xz, yz = _moments(element)
    lines = dict.fromkeys(("mass", "inertia", "position"), element.line)
    inertia = dict(zip(ENTRIES, (xx, xy, xz, yy, yz, zz), strict=True))
    return {"body": {"mass": mass, "inertia": inertia, **frame}, "lines": lines}


def _turn(element: Element, compiler: Mapping[str, str]) -> Body:
    ways = [way for way in WAYS if way in element.attributes]
    if len(ways) > 1:
        message = f"`{ways[0]}` and `{ways[1]}` both turn `<{element.tag}>`, expected one of them"
        raise element.refusal(message)
    if not ways:
        return {}
    values = element.numbers(ways[0], WAYS[ways[0]])
    unit = "" if compiler.get("angle") == "radian" else "deg"
    match ways[0]:
        case "zaxis":
            return {"axis": values}
        case "quat":
            return {"rotation": {"quaternion": values}}
        case "axisangle":
            return {"rotation": {"axis": values[:3], "angle": _angles(values[3:], unit)[0]}}
        case "euler":
            letters = compiler.get("eulerseq", "xyz")
            if len(letters) != 3 or not set(letters.lower()) <= set("xyz"):
                raise element.refusal(f"`eulerseq` is {shown(letters)}, expected three of x, y, z, X, Y, Z")
            # A capital is an axis that stays: its turn comes before all turns so far.
            order = [k for k in (2, 1, 0) if letters[k].isupper()]
            order += [k for k in range(3) if letters[k].islower()]
            angles = _angles([values[k] for k in order], unit)
            return {"rotation": {"euler": angles, "sequence": "".join(letters[k].lower() for k in order)}}
        case _:
            x, y = np.array(values, dtype=np.float64).reshape(2, 3)
            axes, lengths = np.linalg.qr(np.array([x, y]).T)
            if not abs(lengths[0, 0] * lengths[1, 1]) > 1e-12 * (x @ x + y @ y):
                read = shown(element.attributes["xyaxes"])
                raise element.refusal(f"`xyaxes`: read {read}, expected two directions")
            x, y = (axes * np.sign(lengths.diagonal())).T
            return {"rotation": {"matrix": np.array([x, y, np.cross(x, y)]).T.tolist()}}


# The functions that read a file, by the tag of its root.
READERS: dict[str, Callable[[Element, Path], Robot]] = {
    "robot": read_urdf,
    "sdf": read_sdf,
    "mujoco": read_mjcf,
}


@lru_cache(maxsize=4)  # for documents that have one of its links each
def read_robot(text: str, source: str, folder: Path) -> Robot:
    """The links of the robot in `text`; the root of the file tells its format, as some end in `.xml` alike.

    Numbers are decimals, digit by digit; files that are named are looked for below `folder`. Raises
    DocumentError for what is no robot. What is wrong with one link is the problem of that link.
    """
    root = read_elements(text, source)
    if root.tag not in READERS:
        expected = "a robot: `<robot>` of URDF, `<sdf>`, or `<mujoco>` of MJCF"
        raise root.refusal(f"read `<{root.tag[:40]}>`, expected {expected}")
    robot = READERS[root.tag](root, folder)
    if not robot.links:
        raise root.refusal("there are no links in this robot", hint="; ".join(robot.notes) or None)
    return robot._replace(links=_named_once(robot.links))


def _named_once(links: Sequence[Link]) -> list[Link]:
    """The links; one without a name, or with that of another one, has a problem."""
    named, first = [], dict[str, int]()
    for link in links:
        name = shortened(link.name)
        message = "" if name else "missing, expected a `name` of the link"
        if name in first:
            message = f"this name stands twice, first in line {first[name]}"
        first.setdefault(name, link.line)
        own = Problem(link.source, message, link.line, f"link {name}".rstrip()) if message else None
        named.append(link._replace(name=name, problem=link.problem or own))
    return named


def one_link(path: Path, name: str | None) -> Link:
    """The link of this name, or the only one with a mass. Raises ValueProblem with its file and line."""
    try:
        robot = read_robot(read_text(str(path), str(path)), str(path), path.parent)
    except DocumentError as error:
        raise _as_value(error.problems[0]) from None
    links = robot.links
    named = [link for link in links if (not link.without if name is None else link.name == name)]
    if not named or (name is None and len(named) > 1):
        weighed = first_few([link.name for link in links if not link.without])
        read = f"there is no link {shown(name)}" if name else f"there are {len(named)} links with a mass"
        raise ValueProblem(f"{path}: {read}, expected the name of one", hint=f"with a mass: {weighed}")
    link = named[-1]  # of two links of one name, the second one has a problem
    if link.problem is not None:
        raise _as_value(link.problem)
    if link.without:
        raise ValueProblem(f"{path}:{link.line}: link {name}: {link.without}", hint=robot.cure)
    return link


def _as_value(problem: Problem) -> ValueProblem:
    return ValueProblem(str(replace(problem, hint=None)), hint=problem.hint)
