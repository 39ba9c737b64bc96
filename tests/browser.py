"""The browser of all tests and benchmarks of pages: Debian's chromium, Chrome, or Playwright's own.

Without one, a test that uses the fixture `browser` is skipped. The variable `RIGIDIMETER_BROWSER`
changes that: with `required` the test fails, and with `none` no browser is found.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from playwright.sync_api import Browser

VARIABLE = "RIGIDIMETER_BROWSER"
MISSING = (
    "the tests of pages need a browser: `apt-get install chromium`, or Google Chrome, or "
    "`.venv/bin/playwright install --with-deps chromium`"
)


@cache
def find_browser() -> str:
    """Return the path of the browser to use, empty if there is none."""
    from playwright.sync_api import sync_playwright

    if os.environ.get(VARIABLE) == "none":
        return ""
    if path := shutil.which("chromium") or shutil.which("google-chrome"):
        return path
    with sync_playwright() as driver:
        own = driver.chromium.executable_path
    return own if os.access(own, os.X_OK) else ""


@contextmanager
def open_browser() -> Iterator[Browser]:
    """Open a browser; as root too, and where there is little shared memory."""
    from playwright.sync_api import sync_playwright

    path = find_browser() or sys.exit(MISSING)
    with sync_playwright() as driver:
        opened = driver.chromium.launch(
            executable_path=path, args=["--no-sandbox", "--disable-dev-shm-usage"]
        )
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    """Give a browser that is opened once for the tests of a module."""
    with open_browser() as opened:
        yield opened


# Not in the fixture, which would be listed with one line for each test.
@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    if "browser" in getattr(item, "fixturenames", ()) and not find_browser():
        if os.environ.get(VARIABLE) == "required":
            pytest.fail(MISSING, pytrace=False)
        pytest.skip(MISSING)
