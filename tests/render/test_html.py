"""Pages: what stands in them, that all of them are well formed, and that text stays text."""

from __future__ import annotations

import pickle
import re
import sys
from pathlib import Path

import pytest

import rigidcli
from rigidcli.render.plots import LIBRARIES
from rigidcli.render.web.mathml import formula
from tests.conftest import ROOT, Outcome, Program
from tests.markup import Element, markup
from tests.tables import rows_of

CUBE, HANDLE = "configs/cube_symbolic.yaml", "configs/t_handle.yaml"


PAGES: dict[tuple[str, ...], str] = {}
"""Pages of documents in configs/, each of which is made once."""


def page(program: Program, *arguments: str) -> Element:
    if arguments not in PAGES:
        outcome = program(*arguments, "-q", "-f", "html")
        assert outcome.code == 0, outcome.err
        PAGES[arguments] = outcome.out
    return markup(PAGES[arguments])


def texts(root: Element, tag: str) -> list[str]:
    return [" ".join(element.text.split()) for element in root.all(tag)]


# --- What stands in a page


def test_a_page_has_results_formulas_a_picture_samples_and_the_document(program: Program) -> None:
    root = page(program, "euler", HANDLE)
    assert texts(root, "h1") == texts(root, "title") == ["T-handle: motion by Euler's equations"]
    rows = {row.children[0].text: row.children[1] for row in root.all("tr") if len(row.children) == 2}
    result = rigidcli.euler(ROOT / HANDLE)
    assert rows["time between flips"].text == f"τ/2={result['flip_interval']:.6g}s"
    (picture,) = root.all("img")
    assert picture.attributes["alt"] == "T-handle: angular velocity along the axes of the body"
    samples = root.all("table")[-1]
    assert len(samples.all("tr")) == 1 + 11
    assert (ROOT / HANDLE).read_text().strip() == root.all("pre")[0].text.strip()


def test_the_working_stands_open_on_demand(program: Program) -> None:
    assert texts(page(program, "axes", CUBE), "summary") == [f"The document: {CUBE}"]
    root = page(program, "axes", CUBE, "--steps")
    assert texts(root, "summary") == [f"The document: {CUBE}"]
    (working,) = [part for part in root.all("div") if part.attributes.get("class") == "working"]
    assert len(working.all("li")) == len(rigidcli.axes(CUBE, steps=True).steps)
    assert any("(2μ−λ)(11μ−λ)2" in math.text for math in working.all("p"))


@pytest.mark.parametrize("config", ["top_looping", "earth"])
def test_a_result_in_a_notebook_is_short(config: str) -> None:
    pytest.importorskip("matplotlib")
    assert len(rigidcli.euler(ROOT / f"configs/{config}.yaml")._repr_html_()) <= 150_000


def test_digits_units_and_diagnostics_are_as_in_the_table(program: Program) -> None:
    root = page(program, "euler", HANDLE, "--digits", "3", "--units", "ms", "-v")
    words = " ".join(root.text.split())
    assert "τ/2=2.11×103ms" in words
    assert "closed form" in words
    assert "closed form" not in page(program, "euler", HANDLE).text


def test_another_picture_is_drawn_on_demand_and_none_of_what_has_no_values(program: Program) -> None:
    (picture,) = page(program, "euler", HANDLE, "--plot-kind", "polhode").all("img")
    assert "polhode" in picture.attributes["alt"]
    assert page(program, "axes", CUBE).all("img") == []
    assert program("axes", CUBE, "-f", "html", "--plot-kind", "body").code == 3
    assert program("axes", CUBE, "-f", "html", "--plot-kind", "orbit").code == 2


def test_several_files_have_a_table_of_contents(program: Program) -> None:
    root = page(program, "axes", HANDLE, "configs/water.yaml", CUBE)
    (nav,) = root.all("nav")
    assert texts(root, "h1") == ["3 results"]
    assert texts(nav, "li") == texts(root, "h2")
    sections = [section.attributes["id"] for section in root.all("section")]
    assert [link.attributes["href"] for link in nav.all("a")] == [f"#{name}" for name in sections]


def test_a_bad_file_leaves_the_page_of_the_others(program: Program, tmp_path: Path) -> None:
    bad, out = tmp_path / "bad.yaml", tmp_path / "out.html"
    bad.write_text("body: {shape: cub}")
    assert program("axes", HANDLE, str(bad), "-f", "html", "-o", str(out)).code == 3
    root = markup(out.read_text())
    assert texts(root, "h1") == ["1 result"]
    assert texts(root, "h2") == ["T-handle: principal moments and axes"]
    out.unlink()
    assert program("axes", str(bad), "-f", "html", "-o", str(out)).code == 3
    assert not out.exists()


@pytest.mark.parametrize("use", ["drawing", "formulas"])
def test_without_the_extra_the_message_says_how_to_get_it(
    program: Program, monkeypatch: pytest.MonkeyPatch, use: str
) -> None:
    monkeypatch.setitem(LIBRARIES, use, "no_such")
    outcome = program("axes", HANDLE, "-f", "html")
    assert (outcome.code, outcome.out) == (2, "")
    assert "no_such is not installed" in outcome.err
    assert "rigidcli[show]" in outcome.err


# --- Formulas


@pytest.mark.parametrize(
    ("latex", "text"),
    rows_of(__file__, "formulas say what their latex says"),
)
def test_formulas_say_what_their_latex_says(latex: str, text: str) -> None:
    root = markup(formula(latex))
    assert root.text.replace("\N{NO-BREAK SPACE}", " ") == text
    assert root.all("math")


def test_signs_before_and_between_are_told_apart() -> None:
    first, second = markup(formula(r"-a - b")).all("math")
    assert first.all("mo")[0].attributes["form"] == "prefix"
    assert second.all("mo")[0].attributes["form"] == "infix"
    (inner,) = markup(formula(r"\left(-a\right)")).all("mo")[1:2]
    assert inner.attributes["form"] == "prefix"


@pytest.mark.parametrize("latex", [r"\begin{foo}", "{", "x^"])
def test_what_cannot_be_converted_stays_latex(latex: str) -> None:
    assert markup(formula(latex)).text == f"${latex}$"


def test_long_sums_wrap_between_their_terms() -> None:
    long = " + ".join(f"x_{{{k}}}" for k in range(40))
    root = markup(formula(rf"H = {long} - \left(a + b\right)"))
    assert len(root.all("math")) == 1 + 40 + 1
    assert len(root.all("wbr")) == 41


# --- Text that would like to be more

HOSTILE = (
    """</script><script>alert('1')</script> "quoted" <img src=x onerror=alert(1)> & javascript:alert(1)"""
)


def hostile(program: Program, tmp_path: Path, *arguments: str) -> tuple[Element, Outcome]:
    path = tmp_path / """a"><script>alert(2)<'.yaml"""
    path.write_text(
        f"name: '{HOSTILE.replace(chr(39), chr(39) * 2)}'\n"
        f"description: '{HOSTILE.replace(chr(39), chr(39) * 2)}'\n"
        "# <script>alert(3)</script>\n"
        "parameters: {a: 1, script: 2}\n"
        "body: {shape: cube, side: a, mass: 1}\n"
        "motion: {omega: [0, 0, 1]}\n"
    )
    outcome = program("axes", "-f", "html", "--steps", *arguments, str(path))
    assert outcome.code == 0, outcome.err
    return markup(outcome.out), outcome


def test_hostile_text_stays_text(program: Program, tmp_path: Path) -> None:
    root, outcome = hostile(program, tmp_path)
    assert not any("alert" in script.text for script in root.all("script"))
    assert HOSTILE in root.all("h1")[0].text
    assert HOSTILE in root.all("title")[0].text
    assert HOSTILE in root.all("img")[0].attributes["alt"]
    assert "<script>alert(3)</script>" in root.all("pre")[0].text
    assert "a\"><script>alert(2)<'.yaml" in root.all("summary")[-1].text
    assert outcome.out.count("<script") == 3  # the data of the body, what draws it, and what fits formulas
    assert "parameter `script` is not used" in root.all("aside")[0].text


# --- Notebooks


def section(shown: str) -> str:
    """What stands in the section of a page or a fragment, but for names of its own and the replay."""
    (found,) = re.findall(r"<section[^>]*>(.*)</section>", shown, re.DOTALL)
    found = re.sub(r"<figure class=rigidcli-replay>.*?</figure>\n?", "", found, flags=re.DOTALL)
    return found.replace("h1>", "h2>").replace("<figure class=still>", "<figure>")


@pytest.mark.parametrize(
    ("study", "config"),
    [("axes", "cube_corner"), ("euler", "t_handle")],
)
def test_a_notebook_shows_what_the_page_does(study: str, config: str, program: Program) -> None:
    path = f"configs/{config}.yaml"
    outcome = program(study, path, "-q", "-f", "html")
    result = getattr(rigidcli, study)(path)
    assert (result.scene, result.pictures) == (None, ())
    assert section(result._repr_html_()) == section(outcome.out)


def test_no_style_of_a_notebook_leaves_its_section() -> None:
    root = markup(rigidcli.axes(ROOT / HANDLE, steps=True)._repr_html_())
    assert root.all("html") == root.all("script") == []
    assert len(root.all("img")) == 1
    (style,) = root.all("style")
    bare = re.sub(r"@(?:media|container)[^{]*\{((?:[^{}]*\{[^{}]*\})*)\s*\}", r"\1", style.text)
    rules = re.findall(r"([^{}]+)\{", bare)
    selectors = [each.strip() for rule in rules for each in re.split(r",(?![^(]*\))", rule)]
    assert selectors
    assert all(each.startswith(".rigidcli") for each in selectors)


def test_a_result_is_seen_as_far_as_it_can_be_worked_again(tmp_path: Path) -> None:
    """Not where its points are gone, nor in the process that it is sent to; an ensemble has no replay."""
    file = tmp_path / "points.csv"
    file.write_text("m,x,y,z\n1,1,0,0\n2,0,1,0\n3,0,0,1\n", "utf-8")
    motion = {"omega": [0, 0.1, 1], "duration": 5, "samples": 11}
    result = rigidcli.euler({"body": {"points": str(file)}, "motion": motion})
    assert "<canvas" in result._repr_html_()
    there = pickle.loads(pickle.dumps(result))
    file.unlink()
    several = {"body": {"moments": [1, 2, 3]}, "motion": motion | {"omega": [[0, 0, 1], [0, 1, 0]]}}
    for one in (result, there, rigidcli.euler(several)):
        shown = one._repr_html_()
        assert "Results" in shown
        assert "<figure" not in shown


def test_notebooks_need_no_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(LIBRARIES, "drawing", "no_such")
    monkeypatch.setitem(sys.modules, "latex2mathml.converter", None)
    root = markup(rigidcli.euler(ROOT / HANDLE)._repr_html_())
    assert root.all("img") == root.all("math") == []
    assert len(root.all("canvas")) == 1
    assert "$T = " in root.text
