"""The frame of a page, in a real browser: its style, its policy, and words that stay words."""

from __future__ import annotations

from pathlib import Path

import pytest

from rigidcli.render.web.page import page, text
from tests.browser.conftest import Browser

HOSTILE = '</title><script>document.hit = 1</script><img src=x onerror="document.hit = 2">'


@pytest.mark.parametrize("width", [390, 1280])
@pytest.mark.parametrize("dark", [False, True])
def test_a_page_shows_its_words_as_words(browser: Browser, tmp_path: Path, width: int, dark: bool) -> None:
    file = tmp_path / "page.html"
    file.write_text("".join(page(HOSTILE, [f"<h1>{text(HOSTILE)}</h1>"])), "utf-8")
    browser.open_page(file, width, dark=dark)
    assert browser.driver.title == HOSTILE
    assert browser.find("h1").text == HOSTILE
    assert browser.ask("document.hit === undefined")
    assert browser.ask("getComputedStyle(document.body).backgroundColor") == (
        "rgb(22, 22, 26)" if dark else "rgb(255, 255, 255)"
    )
    assert browser.overflow <= 0
    assert browser.complaints() == []
    assert browser.requests() == [file.as_uri()]


def test_the_policy_of_a_page_lets_nothing_out(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "page.html"
    outside = "new Image().src = 'https://example.org/a.png'; fetch('https://example.org/').catch(() => {});"
    file.write_text("".join(page("a page", ["<p>text</p>"], [outside])), "utf-8")
    browser.open_page(file)
    assert any("Content Security Policy" in each for each in browser.complaints())
