"""Robots on the command line: a result a link, the judgement of `validate`, and blocks to paste."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
import yaml

import rigidcli
from rigidcli.render import TRAITS, Format
from tests.conftest import ROOT, Program

ARM = (ROOT / "configs" / "arm.urdf").read_text()

"""The arm with a forearm that no body is: 0.2 > 0.0076 + 0.0076."""


def test_the_arm_of_the_configs(program: Program) -> None:
    """The drum m (3 r^2 + h^2)/12, the bar m L^2/3 + m b^2/12, the rod m r^2/4 + m L^2/3."""
    outcome = program("axes", "-f", "csv", "configs/arm.urdf")
    assert outcome.code == 0
    assert outcome.err == (
        "configs/arm.urdf: note: 1 link has no mass: tool (line 41)\n"
        "configs/arm.urdf: note: 3 links have a mass, 8.7 kg in all\n"
    )
    drum, bar, rod = csv.DictReader(io.StringIO(outcome.out))
    assert [row["name"] for row in (drum, bar, rod)] == ["base", "upper arm", "forearm"]
    assert float(drum["Ixx"]) == pytest.approx(5 * (3 * 0.1**2 + 0.06**2) / 12 + 5 * 0.03**2)
    assert float(bar["Izz"]) == pytest.approx(2.7 * 0.4**2 / 3 + 2.7 * 0.05**2 / 12)
    assert float(rod["Iyy"]) == pytest.approx(0.02**2 / 4 + 0.3**2 / 3)
    assert float(rod["Ixx"]) == pytest.approx(0.02**2 / 2)
    changed = program("inertia", "-q", "-f", "json", "--set", "about=com", "configs/arm.urdf")
    for line in changed.out.splitlines():
        assert json.loads(line)["tensor"] == json.loads(line)["tensor_com"]
    assert (
        program("validate", "-q", "configs/arm.urdf").out
        == "configs/arm.urdf: valid\n  links: 3 with a mass\n"
    )


def block(entries: str, rest: str = "", mass: str = "2", origin: str = "") -> str:
    names = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), entries.split(), strict=True)
    tensor = " ".join(f'{name}="{entry}"' for name, entry in names)
    inertial = f'<inertial>{origin}<mass value="{mass}"/>\n<inertia {tensor}/></inertial>'
    return f'<robot name="r"><link name="l">{inertial}{rest}</link></robot>'


def test_links_that_are_refused_do_not_count(program: Program, tmp_path: Path) -> None:
    def link(name: str, mass: int, moment: int) -> str:
        tensor = f'<inertia ixx="{moment}" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>'
        return f'<link name="{name}"><inertial><mass value="{mass}"/>{tensor}</inertial></link>'

    links = "".join([link("a", 2, 1), link("b", -7, 1), link("c", 3, 9), link("d", 4, 2)])
    path = tmp_path / "r.urdf"
    path.write_text(f'<robot name="r">{links}</robot>')
    outcome = program("inertia", str(path))
    assert "note: 2 links have a mass, 6 kg in all" in outcome.err


LINKS = yaml.safe_load(Path(__file__).with_name("links.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("group", "case"), [(group, case) for group, cases in LINKS.items() for case in cases]
)
def test_what_is_wrong_or_suspicious_is_named(
    group: str, case: dict[str, str], program: Program, tmp_path: Path
) -> None:
    path = tmp_path / "link.urdf"
    path.write_text(case["link"])
    outcome = program("validate", str(path))
    assert outcome.code == (3 if group == "refused" else 0)
    assert ("link l: note: " in outcome.err) == (group == "noted")
    assert case.get("says", "") in outcome.err
    assert outcome.err or group == "fits"


def test_no_edit_is_named_where_two_help(program: Program, tmp_path: Path) -> None:
    path = tmp_path / "two.urdf"
    path.write_text(block("0.02 0 0 0.021 0 0.2"))  # a rod along x or y with 0.2 for the others, or 0.02
    outcome = program("validate", str(path))
    assert outcome.code == 3
    assert "instead of" not in outcome.err


NOTED = """<robot name="r">
<link name="absurd"><inertial><mass value="1.2"/>
<inertia ixx="9000" ixy="0" ixz="0" iyy="9000" iyz="0" izz="9000"/></inertial></link>
<link name="noise"><inertial><mass value="1.3"/>
<inertia ixx="2e-35" ixy="0" ixz="0" iyy="2e-35" iyz="0" izz="2e-35"/></inertial></link></robot>"""


def test_notes_on_the_body_of_a_link_name_its_line(program: Program, tmp_path: Path) -> None:
    path = tmp_path / "noted.urdf"
    path.write_text(NOTED)
    _, absurd, noise = program("validate", str(path)).err.splitlines()
    assert absurd.startswith(f"{path}:3: link absurd: note: a radius of gyration of 86.6 m is large")
    assert noise.startswith(f"{path}:5: link noise: note: a radius of gyration of 4e-18 m is rounding: ")


WHOLE = {
    "urdf": '<robot name="r"><link name="l">{}</link></robot>',
    "sdf": '<sdf version="1.9"><model name="m"><link name="l">{}</link></model></sdf>',
    "mjcf": '<mujoco><worldbody><body name="l"><freejoint/>{}</body></worldbody></mujoco>',
}

ENDINGS = {"urdf": ".urdf", "sdf": ".sdf", "mjcf": ".xml"}

BODY = """
name: "lopsided -- part"
frame: {axis: [1, 2, 3], angle: 40 deg}
body:
  parts:
    - {shape: box, size: [0.1, 0.2, 0.3], density: 1000, anchor: corner}
    - {shape: cylinder, radius: 0.05, height: 0.4, density: 2700, position: [0.3, -0.1, 0.2], axis: [1, 1, 0]}
    - {points: [[1, 0.5, 0.6, -0.7]]}
"""


BLOCKS = [form for form in Format if TRAITS[form].studies == ("inertia",)]


@pytest.mark.parametrize("form", BLOCKS)
def test_a_block_holds_what_is_read_back(form: str, program: Program, tmp_path: Path) -> None:
    path = tmp_path / f"robot{ENDINGS[form]}"
    pasted = program("inertia", "-f", form, "-", stdin=BODY)
    assert (pasted.code, pasted.err) == (0, "")
    path.write_text(WHOLE[form].format(pasted.out))
    (told, back) = (
        json.loads(program("inertia", "-f", "json", *source, stdin=BODY).out)
        for source in (["-"], [str(path)])
    )
    for key in ("mass", "center_of_mass", "tensor_com"):
        assert told[key] == back[key]


FACET = "facet normal 0 0 0 outer loop vertex 0 0 0 vertex {} endloop endfacet\n"

# Two triangles, which are no closed surface, in a box of 200 by 300 by 400 mm.
DRAWN = "solid bar\n" + FACET.format("200 0 0 vertex 0 300 400") + FACET.format("200 300 0 vertex 0 0 400")


def test_the_box_of_a_mesh_is_compared(program: Program, tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    (tmp_path / "urdf").mkdir()
    for name in ("meshes/bar.stl", "urdf/bar.STL"):
        (tmp_path / name).write_text(DRAWN + "endsolid bar\n")
    path = tmp_path / "urdf" / "robot.urdf"
    told = {
        "package://anything/meshes/bar.stl": True,
        f"package://{tmp_path.name}/meshes/bar.stl": True,
        "../meshes/bar.stl": True,
        "bar.STL": True,
        f"file://{tmp_path}/meshes/bar.stl": True,
        "meshes/bar.stl": False,  # there is no such file
        "bar.dae": False,
        "b" * 5000 + ".stl": False,
    }
    shape = "<visual><geometry>{}</geometry></visual>"
    beside = shape.format('<sphere radius="0.01"/>')
    for name, is_told in told.items():
        mesh = shape.format(f'<mesh filename="{name}" scale="0.001 0.001 0.001"/>')
        path.write_text(block("0.5 0 0 0.4 0 0.26", mesh + beside, "24", '<origin xyz="0.1 0.1 0.6"/>'))
        outcome = program("validate", str(path))
        assert outcome.code == 0
        text = "is 0.2 m outside the box of its geometry, whose diagonal is 0.555 m\n"
        assert outcome.err.endswith(text) == is_told == bool(outcome.err), (name, outcome.err)


def test_a_link_is_a_form_of_body_in_documents(program: Program, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text((ROOT / "configs" / "arm.urdf").read_text())
    document = tmp_path / "gripper.yaml"
    document.write_text(
        "body:\n  parts:\n"
        "    - {robot: arm.urdf, link: forearm, position: [0, 0, 1],\n"
        "       rotation: {axis: [0, 1, 0], angle: pi/2}}\n"
        "    - {shape: sphere, radius: 5 cm, mass: 1}\n"
    )
    found = rigidcli.inertia(document)
    links = rigidcli.load_all(tmp_path / "arm.urdf")
    (alone,) = (rigidcli.inertia(link) for link in links if link.name == "forearm")
    mass, (x, y, z) = alone["mass"], alone["center_of_mass"]
    # The turn takes x to -z and z to x.
    com = np.array([z, y, 1 - x])
    np.testing.assert_allclose(found["center_of_mass"], mass * com / (mass + 1), rtol=1e-14)
    turn = np.array([[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    central = turn @ np.array(alone["tensor_com"]) @ turn.T
    expected = central + mass * (com @ com * np.eye(3) - np.outer(com, com)) + 0.4 * 0.05**2 * np.eye(3)
    np.testing.assert_allclose(found["tensor"], expected, rtol=1e-14, atol=1e-16)
    exact = rigidcli.inertia(f"body: {{robot: '{tmp_path}/arm.urdf', link: base}}", exact=True)
    assert str(exact["tensor"][0][0]) == "37/2000"
    swept = program("inertia", str(document), "--sweep", "body.parts.0.link=forearm,base", "-f", "csv").out
    assert [row.split(",")[0] for row in swept.splitlines()] == ["body.parts.0.link", "forearm", "base"]


def test_a_link_whose_name_stands_twice_is_told(tmp_path: Path) -> None:
    link = '<link name="b"><inertial/></link>\n'
    (tmp_path / "r.urdf").write_text(f'<robot name="r">\n{link}{link}</robot>')
    with pytest.raises(rigidcli.RigidError, match=r"r.urdf:3: link b: this name stands twice"):
        rigidcli.loads(f"body: {{robot: '{tmp_path}/r.urdf', link: b}}")
