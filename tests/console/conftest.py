from __future__ import annotations

from collections.abc import Callable, Iterator

import pytest
from playwright.sync_api import Browser
from tests.console.opened import Console

# At a quarter of the usual rate: how fast the loop can be is not what is tested.
PROTOCOL = """
rig = {tick_rate_hz = 250.0, torque = {rate_hz = 250.0}, motion = {rate_hz = 250.0}}
prbs.duration_s = 2.0
protocol.rests_s = [1.5]
protocol.return_s = 0.5
protocol.blocks = [{task = "prbs", condition = "OFF", epochs = 2}]
zeroing.duration_s = 0.5
"""


@pytest.fixture
def chromium(browser: Browser) -> Iterator[Browser]:
    """Give the browser of the module without a page."""
    yield browser
    for context in browser.contexts:
        context.close()


@pytest.fixture(scope="module")
def started() -> Iterator[list[Console]]:
    made: list[Console] = []
    yield made
    for one in made:
        one.close()


@pytest.fixture
def console(
    started: list[Console], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Callable[..., Console]]:
    """Give a console on the virtual rig that is ready for a session, and all in one folder.

    It is one that a test before has left in order, if there is one.
    """

    def ready() -> Console:
        if not started or started[-1].process.poll() is not None:
            folder = started[-1].place if started else tmp_path_factory.mktemp("console")
            started.append(Console(folder, protocol=PROTOCOL))
        return started[-1]

    yield ready
    for one in started:
        if one.leads_session():
            one.close()
