"""Pages as the command line writes them, in a real browser: of results, and of a class with its students."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.browser.conftest import Browser
from tests.conftest import Program

FILES = ("configs/t_handle.yaml", "configs/cone_top.yaml")
"""A body by itself and a top: pages of several FILES have a table of contents, and a replay for each."""

OPENED = "document.querySelectorAll('details').forEach((each) => { each.open = true; })"
"""Opens all that is folded."""

FLAT = """[...document.querySelectorAll('math')].filter((each) => {
    const { width, height } = each.getBoundingClientRect();
    return width < 4 || height < 6;
}).length"""
"""How many formulas are not drawn."""


def test_a_page_of_the_command_line(browser: Browser, program: Program, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    assert program("euler", "-q", "--steps", "-f", "html", "-o", str(file), *FILES).code == 0
    browser.open_page(file, 1280, still=True)
    assert browser.ask("document.querySelector('.working').offsetHeight") > 300
    browser.driver.execute_script(OPENED)
    assert browser.ask("document.querySelectorAll('math').length") > 50
    assert browser.ask(FLAT) == 0
    for width in (1280, 390):
        browser.resize(width)
        assert browser.overflow <= 0, width
    for link in browser.driver.find_elements("css selector", "nav a"):
        link.click()
        browser.wait("Math.abs(document.querySelector(location.hash).getBoundingClientRect().y) < 5")
    assert len(browser.driver.find_elements("css selector", "figure canvas")) == len(FILES)
    assert browser.complaints() == []
    assert browser.requests() == [file.as_uri()]


def test_a_page_in_print(browser: Browser, program: Program, tmp_path: Path) -> None:
    """On paper there is nothing to press, and all that is folded is there."""
    file = tmp_path / "page.html"
    assert program("euler", "-q", "--steps", "-f", "html", "-o", str(file), FILES[0]).code == 0
    browser.open_page(file, 1280, dark=True)
    browser.print_page()
    assert browser.ask("getComputedStyle(document.body).backgroundColor") == "rgb(255, 255, 255)"
    assert browser.ask("document.querySelector('.controls').offsetHeight") == 0
    assert browser.ask("document.querySelector('canvas').offsetHeight") > 100
    assert browser.ask("document.querySelector('div.working li').offsetHeight") > 10
    assert browser.ask(FLAT) == 0


def test_a_body_is_shown_once(browser: Browser, program: Program, tmp_path: Path) -> None:
    """On the screen by the view that can be turned, on paper by the picture."""
    file = tmp_path / "page.html"
    assert program("axes", "-q", "-f", "html", "-o", str(file), "configs/t_handle.yaml").code == 0
    browser.open_page(file, 1280)
    heights = "['canvas', 'img'].map((name) => document.querySelector(name).offsetHeight > 100)"
    assert browser.ask(heights) == [True, False]
    browser.print_page()
    assert browser.ask(heights) == [False, True]


def test_the_pages_of_a_class(browser: Browser, program: Program, tmp_path: Path) -> None:
    homework = ("configs/homework/assignment.yaml", "configs/homework/answers")
    options = ("--feedback", "full", "-f", "html", "-o", f"{tmp_path}/")
    assert program("check", "-q", *homework, *options).code == 1
    index = tmp_path / "index.html"
    browser.open_page(index, 390)
    assert browser.overflow <= 0
    links = browser.ask("[...document.querySelectorAll('a')].map((each) => each.href)")
    assert set(links) == {file.as_uri() for file in tmp_path.iterdir() if file != index}
    browser.resize(1280)
    assert browser.overflow <= 0
    browser.find("a[href='bob.html']").click()
    browser.wait("document.querySelector('h1').textContent === 'bob'")
    browser.driver.execute_script(OPENED)
    assert browser.ask(FLAT) == 0
    for width in (1280, 390):
        browser.resize(width)
        assert browser.overflow <= 0, width
    assert browser.complaints() == []
    assert set(browser.requests()) <= {index.as_uri(), *links}


def test_a_slider_chooses_a_value_of_a_sweep(browser: Browser, program: Program, tmp_path: Path) -> None:
    """The value, the motion and the results change together; nothing is fetched."""
    file = tmp_path / "page.html"
    sweep = ("--sweep", "top.spin=1000 rpm,2000 rpm,3000 rpm", FILES[1])
    assert program("euler", "-q", "-f", "html", "-o", str(file), *sweep).code == 0
    browser.open_page(file, 390, still=True)
    readings = "[...document.querySelectorAll('.readings div')]"
    spin = f"{readings}.find((each) => each.textContent.startsWith('ω3')).lastChild.textContent"
    seen = []
    for place in range(3):
        browser.driver.execute_script(
            "const slider = document.querySelector('.choice input');"
            "slider.value = arguments[0]; slider.oninput()",
            place,
        )
        shown = browser.ask("document.querySelector('.choice output').textContent")
        reading = float(browser.ask(spin).split()[0])
        assert float(shown.split()[2]) == pytest.approx(reading, rel=1e-4)
        (results,) = browser.ask(
            "[...document.querySelectorAll('.chosen:not([hidden])')].map((e) => e.textContent)"
        )
        seen.append((reading, results))
    assert len(set(seen)) == len({results for _, results in seen}) == 3
    assert browser.overflow <= 0
    assert browser.complaints() == []
    assert browser.requests() == [file.as_uri()]
    assert browser.ask("document.querySelectorAll('canvas').length") == 1


def test_a_long_sweep_is_a_table(program: Program) -> None:
    outcome = program(
        "euler", "-q", "-f", "html", "--sweep", "top.spin=100:300:61", "--samples", "2", FILES[1]
    )
    assert outcome.out.count("<tr>") == 62
    assert "<canvas" not in outcome.out
