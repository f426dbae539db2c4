"""Robot descriptions: what is read from them is what MuJoCo reads, and hostile files are refused."""

from __future__ import annotations

import random
import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import rigidcli
from rigidcli.document.load import Drafts, robot_drafts
from rigidcli.document.load import read as read_draft
from rigidcli.errors import RigidError
from rigidcli.studies.robots import remarks, repair
from tests.conftest import ROOT
from tests.tables import rows_of

ARM = (ROOT / "configs" / "arm.urdf").read_text()

SDF = """<sdf version="1.9"><model name="m"><link name="l">{}</link></model></sdf>"""

MJCF = """<mujoco>{}<worldbody><body name="l"><freejoint/>{}</body></worldbody></mujoco>"""

TENSOR = np.array([[0.1, 0.01, -0.02], [0.01, 0.2, 0.03], [-0.02, 0.03, 0.25]])


def urdf(inertial: str) -> str:
    return f'<robot name="r"><link name="l">{inertial}</link></robot>'


def origin(xyz: Sequence[float], rpy: Sequence[float]) -> str:
    """An inertial block of URDF with a tensor that has six entries."""
    place = f'xyz="{" ".join(map(str, xyz))}" rpy="{" ".join(map(str, rpy))}"'
    names = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), TENSOR[np.triu_indices(3)], strict=True)
    entries = " ".join(f'{name}="{entry}"' for name, entry in names)
    return f'<inertial><origin {place}/><mass value="2"/><inertia {entries}/></inertial>'


def read(text: str, ending: str, folder: Path) -> list[Any]:
    """The results of `inertia` for all links of a text."""
    path = folder / f"robot{ending}"
    path.write_text(text)
    return [rigidcli.inertia(document) for document in rigidcli.load_all(path)]


def robot_of(text: str, name: str) -> Drafts:
    """The links of a text, not yet read, and notes."""
    return robot_drafts(text, name, "")


def by_mujoco(text: str, name: str = "l") -> tuple[float, Any, Any]:
    """Mass, centre of mass and the tensor about it in the axes of the body, as MuJoCo compiles them."""
    mujoco: Any = pytest.importorskip("mujoco", reason="MuJoCo is the oracle here")
    model = mujoco.MjModel.from_xml_string(text)
    body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, name)
    axes = np.zeros(9)
    mujoco.mju_quat2Mat(axes, model.body_iquat[body])
    turn = axes.reshape(3, 3)
    tensor = turn @ np.diag(model.body_inertia[body]) @ turn.T
    return model.body_mass[body], model.body_ipos[body], tensor


def agree(result: Any, text: str, name: str = "l") -> None:
    mass, centre, tensor = by_mujoco(text, name)
    assert result["mass"] == pytest.approx(mass, rel=1e-15)
    np.testing.assert_allclose(result["center_of_mass"], centre, atol=1e-15)
    np.testing.assert_allclose(result["tensor_com"], tensor, atol=2e-15)


finite = st.floats(-3, 3).map(lambda value: round(value, 3))
three = st.tuples(finite, finite, finite)


@settings(max_examples=25)
@given(three, three)
def test_urdf_and_sdf_turn_the_tensor_by_roll_pitch_and_yaw(
    tmp_path_factory: pytest.TempPathFactory, xyz: tuple[float, ...], rpy: tuple[float, ...]
) -> None:
    """The turns are about the fixed axes x, y, z, in this order; scipy's small letters say the same."""
    folder = tmp_path_factory.mktemp("robot")
    turn = Rotation.from_euler("xyz", rpy).as_matrix()
    names = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), TENSOR[np.triu_indices(3)], strict=True)
    entries = "".join(f"<{name}>{entry}</{name}>" for name, entry in names)
    pose = " ".join(map(str, (*xyz, *rpy)))
    block = f"<inertial><pose>{pose}</pose><mass>2</mass><inertia>{entries}</inertia></inertial>"
    (one,) = read(urdf(origin(xyz, rpy)), ".urdf", folder)
    (other,) = read(SDF.format(block), ".sdf", folder)
    for result in (one, other):
        np.testing.assert_allclose(result["center_of_mass"], xyz, atol=1e-15)
        np.testing.assert_allclose(result["tensor_com"], turn @ TENSOR @ turn.T, atol=1e-15)


def test_urdf_is_what_mujoco_reads(tmp_path: Path) -> None:
    block = origin([0.3, -0.2, 0.1], [0.4, -1.1, 2.5])
    joint = '<link name="b"/><joint name="j" type="floating"><parent link="b"/><child link="l"/></joint>'
    agree(read(urdf(block), ".urdf", tmp_path)[0], urdf(block).replace("</robot>", f"{joint}</robot>"))


POSES = rows_of(__file__, "poses")


@pytest.mark.parametrize("pose", POSES)
def test_mjcf_is_turned_as_mujoco_turns_it(pose: str, tmp_path: Path) -> None:
    compiler, attribute = POSES[pose]
    block = f'<inertial pos="1 -2 0.3" mass="2" diaginertia="1 2 2.5" {attribute}/>'
    text = MJCF.format(compiler, block)
    agree(read(text, ".xml", tmp_path)[0], text)


def test_mjcf_with_a_full_tensor(tmp_path: Path) -> None:
    text = MJCF.format("", '<inertial pos="0 1 0" mass="2" fullinertia="1 2 2.5 0.1 -0.2 0.3"/>')
    agree(read(text, ".xml", tmp_path)[0], text)


INERTIAL = '<inertial pos="0 0 .1" mass="2" diaginertia="1 1 1.5"/><geom size=".1"/>'
CURE = "saveinertial"


@pytest.mark.parametrize(
    ("compiler", "inside", "reason"),
    [
        ('<compiler inertiafromgeom="true"/>', INERTIAL, "`inertiafromgeom` lets MuJoCo change masses and"),
        ('<compiler balanceinertia="true"/>', INERTIAL, "`balanceinertia` lets MuJoCo"),
        ('<compiler boundmass="2.5"/>', INERTIAL, "`boundmass` lets MuJoCo"),
        ('<compiler boundinertia="1.2"/>', INERTIAL, "`boundinertia` lets MuJoCo"),
        ('<compiler settotalmass="7"/>', INERTIAL, "`settotalmass` lets MuJoCo"),
        ("", '<include file="more.xml"/>', "`<include>` is not read"),
        ("", f"<frame pos='1 0 0'>{INERTIAL}</frame>", "an `<inertial>` in a `<frame>` is not read"),
        ("", '<geom size="1"/>', "1 link has no `<inertial>`: MuJoCo infers mass and tensor from the geoms"),
    ],
)
@pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass' is deprecated")
def test_what_mujoco_would_make_of_a_file_is_read_once_it_has_saved_it(
    compiler: str, inside: str, reason: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)  # MuJoCo writes its log there
    with pytest.raises(RigidError, match=re.escape(reason)) as told:
        read(MJCF.format(compiler, inside), ".xml", tmp_path)
    assert CURE in str(told.value)
    (tmp_path / "more.xml").write_text('<mujoco><geom size="1"/></mujoco>')
    text = MJCF.format(f'<compiler {CURE}="true"/>{compiler}', inside)
    (tmp_path / "robot.xml").write_text(text)
    mujoco: Any = pytest.importorskip("mujoco", reason="MuJoCo saves the file")
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "robot.xml"))
    mujoco.mj_saveLastXML(str(tmp_path / "saved.xml"), model)
    (saved,) = read((tmp_path / "saved.xml").read_text(), ".xml", tmp_path)
    moments = np.linalg.eigvalsh(saved["tensor_com"])
    np.testing.assert_allclose(moments, np.sort(model.body_inertia[1]), rtol=1e-5)  # it writes six digits
    assert saved["mass"] == pytest.approx(model.body_mass[1], rel=1e-5)


def test_settings_of_mjcf_that_change_nothing_are_read(tmp_path: Path) -> None:
    compiler = '<compiler settotalmass="-1" boundmass="0" balanceinertia="false" inertiafromgeom="auto"/>'
    text = MJCF.format(compiler, '<inertial pos="1 0 0" mass="2" diaginertia="1 2 2.5"/><geom size="1"/>')
    agree(read(text, ".xml", tmp_path)[0], text)


def test_bodies_without_a_name_are_told_apart(tmp_path: Path) -> None:
    body = '<body><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body>'
    text = f"<mujoco><worldbody>\n{body}{body}\n{body}</worldbody></mujoco>"
    names = [result.name for result in read(text, ".xml", tmp_path)]
    assert names == ["body in line 2", "body in line 2, number 2", "body in line 3"]


def test_bodies_of_mjcf_whose_tensor_is_not_written_are_noted(tmp_path: Path) -> None:
    path = tmp_path / "robot.xml"
    one = '<inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>'
    path.write_text(
        f'<mujoco>\n<worldbody>\n<body name="a">{one}\n<body name="b"><geom type="mesh" mesh="m"/></body>\n'
        '<replicate count="2"><body name="c"/></replicate></body></worldbody></mujoco>'
    )
    robot = robot_of(path.read_text(), "robot.xml")
    assert [each.link and each.link.name for each in robot.each] == ["a"]
    assert robot.notes == [
        "bodies that `<replicate>` in line 5 makes are left out",
        (
            "2 links have no `<inertial>`: MuJoCo infers mass and tensor from the geoms, if there are any: "
            "b (line 4), c (line 5)"
        ),
    ]


def test_sdf_has_quaternions_defaults_and_models_in_models(tmp_path: Path) -> None:
    pose = '<pose rotation_format="quat_xyzw">1 2 3 0 0 1 1</pose>'
    inertia = "<inertia><ixx>1</ixx><iyy>2</iyy><izz>2.5</izz></inertia>"
    (result,) = read(SDF.format(f"<inertial>{pose}{inertia}</inertial>"), ".sdf", tmp_path)
    assert result["mass"] == 1
    np.testing.assert_allclose(result["tensor_com"], np.diag([2, 1, 2.5]), atol=1e-15)
    degrees = '<pose degrees="true">0 0 0 0 90 0</pose>'
    (result,) = read(SDF.format(f"<inertial>{degrees}{inertia}</inertial>"), ".sdf", tmp_path)
    np.testing.assert_allclose(result["tensor_com"], np.diag([2.5, 2, 1]), atol=1e-15)
    link = '<link name="l"><inertial/></link>'
    text = f'<sdf><world><model name="a">{link}<model name="b">{link}</model></model></world></sdf>'
    assert [result.name for result in read(text, ".sdf", tmp_path)] == ["a::l", "a::b::l"]


def test_exact_numbers_are_kept_digit_by_digit(tmp_path: Path) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(origin([0.1, 0, 0], [0, 0, 0])))
    assert str(rigidcli.inertia(rigidcli.load(path, exact=True))["tensor"][1, 1]) == "11/50"
    with pytest.raises(RigidError, match="3 links with a mass, expected one"):
        rigidcli.inertia(ROOT / "configs" / "arm.urdf")


BOMB = "".join(f'<!ENTITY a{n} "{f"&a{n - 1};" * 10}">' for n in range(1, 10))

HOSTILE = {
    "billion laughs": (
        f'<!DOCTYPE r [<!ENTITY a0 "ha">{BOMB}]><robot name="&a9;"/>',
        r"robot.urdf:1: read the document type `r`, expected none",
    ),
    "external entity": (
        '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot>&x;</robot>',
        "document type",
    ),
    "external subset": ('<!DOCTYPE r SYSTEM "http://example.org/r.dtd"><robot/>', "document type"),
    "undefined entity": ("<robot>&x;</robot>", "not XML: undefined entity"),
    "deep": ("<robot>" * 100_000, "nested more than 100 deep"),
    "many": ("<robot>" + "<link/>" * 20_000, "more than 15,000 elements"),
    "links": (
        "<robot>" + "".join(f'<link name="{n}"/>' for n in range(1001)) + "</robot>",
        "1,001 links, expected at most 1,000",
    ),
    "empty": ("", "not XML: no element found"),
    "other": ("<project/>", "read `<project>`, expected a robot"),
    "nothing": ("<robot/>", "there are no links"),
    "control characters": ("<robot>\x07</robot>", "not well-formed"),
    "before the declaration": ('\n<?xml version="1.0"?><robot/>', "stands at the very beginning"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_files_are_refused(name: str) -> None:
    text, message = HOSTILE[name]
    began = time.process_time()
    with pytest.raises(RigidError) as refused:
        robot_of(text, "robot.urdf")
    said = f"{refused.value}{refused.value.__dict__.get('problems')}"
    assert refused.value.exit_code == 3
    assert re.search(message, said)
    assert time.process_time() - began < 2


REFUSED = rows_of(__file__, "refused")


@pytest.mark.parametrize("good", REFUSED)
def test_what_is_wrong_in_a_link_is_told(good: str) -> None:
    bad, message = REFUSED[good]
    text = urdf(origin([1, 2, 3], [0, 0, 0]))
    assert good in text
    (each,) = robot_of(text.replace(good, bad, 1), "robot.urdf").each
    with pytest.raises(RigidError) as refused:
        read_draft(each)
    assert re.search(message, str(refused.value))


TRIED = 200
"""How many mutations of each file are tried each time; 10,000 of each were tried once."""

PIECES = [*'<>/="&', "-", "0", "1e308", "1e-320", "nan", "1e9", "&x;", "<!--", "]]>", "</link>", "\0", "é"]


NUMBERS = ["0", "-1", "1e308", "-1e200", "1e-308", "1e400", "nan", "1e60", "", "1 2", "${x}", "9" * 500]
"""What takes the place of numbers: too large, too small, none, or two."""


def mutated(text: str, chance: random.Random) -> str:
    """The text with numbers changed, or a few pieces left out, doubled or put in."""
    if chance.random() < 0.6:  # it stays XML
        numbers = list(re.finditer(r"-?\d[\d.]*", text))
        for match in sorted(chance.sample(numbers, min(3, len(numbers))), key=lambda m: -m.start()):
            text = text[: match.start()] + chance.choice(NUMBERS) + text[match.end() :]
        return text
    for _ in range(chance.randint(1, 4)):
        at, length = chance.randrange(len(text)), chance.randint(0, 12)
        piece = chance.choice([*PIECES, "", text[at : at + 40], chance.choice(text)])
        text = text[:at] + piece + text[at + length :]
    return text


SEEDS = {
    ".urdf": ARM,
    ".sdf": SDF.format(
        '<inertial><pose degrees="true">1 2 3 4 5 6</pose><mass>1</mass><inertia><ixx>1</ixx></inertia>'
        "</inertial><visual><geometry><box><size>1 1 1</size></box></geometry></visual>"
    ),
    ".xml": MJCF.format(
        '<compiler angle="radian" eulerseq="zyx"/><default><geom size="1"/></default>',
        '<inertial pos="1 2 3" mass="1" diaginertia="1 1 1" euler="1 2 3"/>'
        '<geom type="capsule" fromto="0 0 0 1 1 1" size="0.1"/>',
    ),
}


@pytest.mark.parametrize("ending", SEEDS)
def test_a_mutated_file_is_answered_or_refused(ending: str) -> None:
    chance = random.Random(1)
    for _ in range(TRIED):
        text = mutated(SEEDS[ending], chance)
        began = time.process_time()
        try:
            links = robot_of(text, f"robot{ending}").each
        except RigidError:
            continue
        for each in links:
            assert each.link is not None
            try:
                document = read_draft(each)
                assert each.link is not None
                remarks(each.link, document.notes)
                rigidcli.axes(document)
            except RigidError:
                repair(each.link)
        assert time.process_time() - began < 5, text
