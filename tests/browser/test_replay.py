"""The replay in a real browser: it draws, it moves, and it does what its buttons and keys say."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

import rigidcli
from rigidcli.core.arithmetic import Floats
from rigidcli.picture import Mark
from rigidcli.render import Look
from rigidcli.render.html import PAGE
from rigidcli.render.web.page import page
from rigidcli.render.web.replay import player, replay
from rigidcli.report import Column, Table
from rigidcli.scene import Part, Scene, Stage
from tests.browser.conftest import Browser
from tests.conftest import ROOT
from tests.scenes import scene_of

HOSTILE = "</script><img src=x onerror=document.hit=1>{0}\"'&"

SHORT = {
    "body": {"shape": "box", "size": [3, 2, 1], "mass": 1},
    "motion": {"omega": [0, 0, "pi/2"], "duration": 4, "samples": 101},
}
"""A body that turns a quarter round z in a second."""

PENDULUM = ROOT / "configs/double_pendulum.yaml"

BRIEF = ("orbit.duration=2", "orbit.samples=201")
"""Settings for an orbit of two seconds."""

Open = Callable[..., Browser]


@pytest.fixture
def opened(browser: Browser, tmp_path: Path) -> Open:
    """Opens a page with the replay of scenes."""

    def show(*scenes: Scene, first: str = "", last: str = "", **window: Any) -> Browser:
        file = tmp_path / "page.html"
        figures = [replay(scene, Look(), PAGE) for scene in scenes]
        style, script = player()
        file.write_text("".join(page("a replay", [first, *figures, last], [script], [style])), "utf-8")
        browser.open_page(file, **{"width": 640, **window})
        browser.wait("document.querySelectorAll('figure [hidden]:not(.trouble)').length === 0")
        # Replays draw once they are told that they are in view, which comes after a frame or two.
        # This observer is younger than theirs, and so is told after them.
        browser.driver.execute_async_script(
            "new IntersectionObserver(arguments[0]).observe(document.querySelector('.stage'))"
        )
        return browser

    return show


def of_box() -> Scene:
    return scene_of("euler", SHORT)


def of_pendulum() -> Scene:
    return scene_of("hamilton", PENDULUM, BRIEF)


def seen(browser: Browser) -> Floats:
    """The picture on the canvas (rows, columns, colours), without the buttons on it."""
    browser.ask("document.querySelector('.view').style.opacity = 0")
    shot = browser.find(".stage").screenshot_as_png
    return np.asarray(matplotlib.image.imread(io.BytesIO(shot)), dtype=float)[..., :3]


def time_of(browser: Browser) -> float:
    return float(str(browser.ask("document.querySelector('.readings dd').textContent")).split()[0])


def press(browser: Browser, *keys: str) -> None:
    """Keys with the names of JavaScript on the canvas; shift goes before a plus."""
    for key in keys:
        *held, name = key.split("+") if len(key) > 1 else [key]
        browser.ask(
            "document.querySelector('canvas').dispatchEvent(new KeyboardEvent('keydown', "
            "{key: arguments[0], shiftKey: arguments[1], bubbles: true, cancelable: true}))",
            name,
            "Shift" in held,
        )


def settled(browser: Browser) -> None:
    """Waits for the frame that is asked for, and the next."""
    browser.driver.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")


def label(browser: Browser, name: str) -> Floats:
    """Where the name of an arrow is (x to the right, y upwards; pixels)."""
    script = """(() => {
        const signs = [...document.querySelectorAll(".labels span")];
        const box = signs.find((each) => each.textContent === arguments[0]).getBoundingClientRect();
        return [box.x + box.width / 2, -box.y - box.height / 2];
    })()"""
    return np.array(browser.ask(script.replace("arguments[0]", repr(name))), dtype=float)


def test_it_plays_by_itself_and_asks_for_nothing(opened: Open, tmp_path: Path) -> None:
    browser = opened(of_box())
    browser.wait("document.querySelector('[data-do=play]').textContent === 'Pause'")
    first = time_of(browser)
    before = seen(browser)
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 20
    browser.wait("parseFloat(document.querySelector('.readings dd').textContent) > arguments[0] + 0.3", first)
    assert np.abs(seen(browser) - before).max() > 0.1
    assert browser.complaints() == []
    assert browser.requests() == [(tmp_path / "page.html").as_uri()]


def test_it_stays_still_for_those_who_want_that(opened: Open) -> None:
    browser = opened(of_box(), still=True)
    settled(browser)
    before = seen(browser)
    assert browser.find("[data-do=play]").text == "Play"
    assert time_of(browser) == 0
    assert np.array_equal(seen(browser), before)
    assert len(np.unique(before.reshape(-1, 3), axis=0)) > 20
    browser.find("[data-do=play]").click()
    browser.wait("parseFloat(document.querySelector('.readings dd').textContent) > 0")


def test_the_body_turns_to_the_side_that_its_omega_says(opened: Open) -> None:
    """Also halfway between two samples, between which it turns by half a turn."""
    browser = opened(scene_of("euler", SHORT, ["motion.samples=3"]), still=True)
    settled(browser)
    start = {name: label(browser, name) for name in ("x", "y", "z", "e₁", "e₂", "e₃")}
    browser.driver.execute_script(
        "const slider = document.querySelector('input[type=range]'); slider.value = 250; slider.oninput()"
    )
    settled(browser)
    assert label(browser, "x") == pytest.approx(start["x"])
    # After a quarter turn about z, the axis that was along x is along y.
    assert np.linalg.norm(label(browser, "e₁") - start["e₂"]) < 12
    assert np.linalg.norm(label(browser, "e₂") - start["e₁"]) > 100
    assert label(browser, "e₃") == pytest.approx(start["e₃"], abs=2)


def test_the_buttons_do_what_they_say(opened: Open) -> None:
    browser = opened(of_box(), still=True)
    settled(browser)

    def click(what: str) -> None:
        browser.find(f"[data-do={what}]").click()
        settled(browser)

    before = seen(browser)
    click("in")
    nearer = seen(browser)
    assert np.abs(nearer - before).max() > 0.1
    click("out")
    assert np.abs(seen(browser) - before).max() < 0.1
    click("in")
    click("reset")
    assert np.array_equal(seen(browser), before)
    speed = browser.find(".speed").text
    click("faster")
    assert float(browser.find(".speed").text.split()[0]) == 2 * float(speed.split()[0])
    click("slower")
    assert browser.find(".speed").text == speed
    click("play")
    browser.wait("parseFloat(document.querySelector('.readings dd').textContent) > 0")
    click("play")
    stopped = time_of(browser)
    settled(browser)
    assert (browser.find("[data-do=play]").text, time_of(browser)) == ("Play", stopped)


def test_the_keys_do_what_they_say(opened: Open) -> None:
    browser = opened(of_box(), still=True)
    settled(browser)
    before = seen(browser)
    for away, back in (("+", "-"), ("Shift+ArrowLeft", "Shift+ArrowRight"), ("Shift+ArrowUp", "0")):
        press(browser, away)
        settled(browser)
        assert np.abs(seen(browser) - before).max() > 0.1, away
        press(browser, back)
        settled(browser)
        assert np.abs(seen(browser) - before).mean() < 0.002, back
    press(browser, "ArrowRight", "ArrowRight", "ArrowLeft", "ArrowRight")
    settled(browser)
    assert time_of(browser) == pytest.approx(0.08)
    press(browser, "End")
    settled(browser)
    assert time_of(browser) == 4
    press(browser, "Home")
    settled(browser)
    assert time_of(browser) == 0
    speed = float(browser.find(".speed").text.split()[0])
    press(browser, "ArrowUp", "ArrowUp", "ArrowDown")
    assert float(browser.find(".speed").text.split()[0]) == 2 * speed
    press(browser, " ")
    browser.wait("parseFloat(document.querySelector('.readings dd').textContent) > 0")
    assert browser.find("[data-do=play]").text == "Pause"


def test_a_finger_turns_it_two_zoom_and_a_wheel_does_after_a_click(opened: Open) -> None:
    browser = opened(of_box(), still=True)
    settled(browser)
    before = seen(browser)
    event = (
        "document.querySelector('canvas').dispatchEvent(new PointerEvent(arguments[0], "
        "{pointerId: arguments[1], clientX: arguments[2], clientY: 300, bubbles: true}))"
    )
    browser.driver.execute_script("document.querySelector('canvas').setPointerCapture = () => {}")
    for name, finger, x in (("pointerdown", 1, 400), ("pointermove", 1, 500)):
        browser.ask(event, name, finger, x)
    settled(browser)
    turned = seen(browser)
    assert np.abs(turned - before).max() > 0.1
    for name, finger, x in (("pointerdown", 2, 600), ("pointermove", 2, 700), ("pointerup", 2, 700)):
        browser.ask(event, name, finger, x)
    settled(browser)
    assert np.abs(seen(browser) - turned).max() > 0.1
    browser.ask(event, "pointerup", 1, 500)
    wheel = (
        "document.querySelector('canvas').dispatchEvent("
        "new WheelEvent('wheel', {deltaY: 100, cancelable: true}))"
    )
    assert browser.ask(wheel) is True  # the page scrolls
    browser.driver.execute_script("document.querySelector('canvas').focus()")
    assert browser.ask(wheel) is False


def test_what_is_unticked_is_hidden_and_another_view_can_be_chosen(opened: Open) -> None:
    browser = opened(of_pendulum(), still=True)
    settled(browser)
    before = seen(browser)
    browser.find(".legend input").click()
    settled(browser)
    without = seen(browser)
    assert np.abs(without - before).max() > 0.1
    browser.driver.execute_script(
        "const list = document.querySelector('select'); list.value = 1;"
        "list.dispatchEvent(new Event('change'))"
    )
    settled(browser)
    assert np.abs(seen(browser) - without).max() > 0.1
    assert any("θ₁:" in each.text for each in browser.driver.find_elements("css selector", ".labels span"))


@pytest.mark.parametrize(("width", "dark"), [(390, True), (1280, False)])
def test_it_fits_into_windows_and_wears_their_colours(opened: Open, width: int, dark: bool) -> None:
    browser = opened(of_box(), of_pendulum(), width=width, dark=dark, density=1.5, still=True)
    settled(browser)
    assert browser.overflow <= 0
    canvas = "document.querySelector('canvas')"
    assert browser.ask(f"{canvas}.width / {canvas}.clientWidth") == pytest.approx(1.5, rel=0.01)
    assert (seen(browser).mean() < 0.5) == dark
    assert browser.complaints() == []


def test_several_on_a_page_are_apart_and_one_out_of_view_rests(opened: Open) -> None:
    browser = opened(of_box(), of_pendulum(), last='<div style="height: 3000px"></div>')
    times = "[...document.querySelectorAll('.readings dd:first-of-type')].map((e) => e.textContent)"
    browser.wait("parseFloat(document.querySelector('.readings dd').textContent) > 0.1")
    browser.driver.execute_script("scrollTo(0, document.body.scrollHeight)")
    browser.wait("document.querySelector('figure').getBoundingClientRect().bottom < 0")
    settled(browser)
    settled(browser)
    stopped = browser.ask(times)
    browser.driver.execute_async_script("setTimeout(arguments[0], 300)")
    assert browser.ask(times) == stopped
    browser.driver.execute_script("scrollTo(0, 0)")
    browser.wait("document.querySelector('.readings dd').textContent !== arguments[0]", stopped[0])
    assert browser.complaints() == []


def test_it_works_in_the_output_of_a_notebook(browser: Browser, tmp_path: Path) -> None:
    """Notebooks put the HTML of an output into their page, and make its scripts anew, so that they run."""
    file = tmp_path / "notebook.html"
    file.write_text("<!DOCTYPE html><div id=one></div><div id=two></div>", "utf-8")
    browser.open_page(file, 640)
    shown = """
        const output = document.getElementById(arguments[0]);
        output.innerHTML = arguments[1];
        for (const old of output.querySelectorAll("script")) {
            const script = document.createElement("script");
            script.textContent = old.textContent;
            for (const each of old.attributes) script.setAttribute(each.name, each.value);
            old.replaceWith(script);
        }"""
    results = {"one": rigidcli.euler(SHORT), "two": rigidcli.hamilton(PENDULUM, settings=BRIEF)}
    for place, result in results.items():
        browser.driver.execute_script(shown, place, result._repr_html_())
    for place in ("one", "two"):
        browser.driver.execute_script(f"{place}.scrollIntoView()")
        browser.wait(f"parseFloat(document.querySelector('#{place} .readings dd').textContent) > 0.1")
    assert browser.ask("document.querySelectorAll('.rigidcli figure > img').length") == 2
    names = browser.ask("[...document.querySelectorAll('[id]')].map((each) => each.id)")
    assert len(names) == len(set(names))
    assert browser.complaints() == []


def test_without_webgl_it_says_so_and_still_tells_the_readings(opened: Open) -> None:
    none = "<script>HTMLCanvasElement.prototype.getContext = () => null;</script>"
    browser = opened(of_box(), first=none)
    browser.wait("document.querySelector('.trouble').textContent.includes('WebGL2')")
    browser.wait("parseFloat(document.querySelector('.readings dd').textContent) > 0")
    assert browser.complaints() == []


def test_hostile_names_stay_text(opened: Open) -> None:
    times = np.linspace(0, 1, 11)
    readings = Table("", HOSTILE, (Column("t", times, (HOSTILE,), "s"), Column("x", times, ("x",), HOSTILE)))
    arrow = Part(Mark("arrow", np.array([[0, 0, 0], [0, 0, 1.0]]), HOSTILE))
    path = Part(
        Mark("line", np.column_stack([times, times, times]), "path", style=9), "traced", group=HOSTILE
    )
    browser = opened(Scene(HOSTILE, times, readings, (Stage(HOSTILE, (arrow, path)),)), width=390, still=True)
    settled(browser)
    assert browser.find("figcaption").text == HOSTILE
    assert browser.find(".labels span").text == HOSTILE
    assert browser.find(".legend label").text.strip() == HOSTILE
    assert browser.ask("document.hit === undefined")
    assert browser.ask("document.querySelectorAll('img').length") == 0
    assert browser.overflow <= 0
    assert browser.complaints() == []
