"""Where a browser is found; without one tests of pages are skipped, or fail if it is required."""

from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright
from tests.browser import MISSING, VARIABLE, find_browser


@pytest.fixture(autouse=True)
def nothing_installed(monkeypatch, tmp_path):
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setenv("PLAYWRIGHT_BROWSERS_PATH", str(tmp_path / "playwright"))
    monkeypatch.setenv("PATH", str(tmp_path))
    find_browser.cache_clear()
    yield tmp_path
    find_browser.cache_clear()


@pytest.mark.parametrize("name", ["chromium", "google-chrome"])
def test_a_browser_is_found_by_its_name(nothing_installed, name):
    (nothing_installed / name).touch(0o755)
    assert find_browser() == str(nothing_installed / name)


@pytest.mark.parametrize(
    ("demand", "outcomes"), [("", {"skipped": 3}), ("required", {"errors": 3})]
)
def test_pages_are_skipped_with_one_line_or_fail(pytester, monkeypatch, demand, outcomes):
    monkeypatch.setenv(VARIABLE, demand)
    monkeypatch.setattr("tests.browser.find_browser", lambda: "")
    pytester.makeconftest("from tests.browser import *")
    body = "def test_a(browser): pass\ndef test_b(browser): pass\n"
    pytester.makepyfile(test_one=body, test_two="def test_c(browser): pass\n")
    result = pytester.runpytest("-rs", "-n", "0")
    result.assert_outcomes(**outcomes)
    assert str(result.stdout).count(MISSING) == (3 if demand else 1)


def test_none_is_found_where_none_is_wanted(nothing_installed, monkeypatch):
    (nothing_installed / "chromium").touch(0o755)
    monkeypatch.setenv(VARIABLE, "none")
    assert find_browser() == ""


def test_the_browser_of_playwright_is_found(nothing_installed, monkeypatch):
    with sync_playwright() as driver:
        path = Path(driver.chromium.executable_path)
    assert path.is_relative_to(nothing_installed)
    path.parent.mkdir(parents=True)
    path.touch(0o755)
    assert find_browser() == str(path)
