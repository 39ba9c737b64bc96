from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser
from tests.console.opened import Console, browser

PROTOCOL = """
prbs.duration_s = 4.0
protocol.rests_s = [2.0]
protocol.return_s = 1.0
protocol.blocks = [{task = "prbs", condition = "OFF", epochs = 2}]
zeroing.duration_s = 0.5
"""


@pytest.fixture
def chromium() -> Iterator[Browser]:
    with browser() as opened:
        yield opened


@pytest.fixture
def console(tmp_path: Path) -> Iterator[Callable[..., Console]]:
    """Start consoles on the virtual rig; all use one folder of sessions."""
    made: list[Console] = []

    def begin(*options: str) -> Console:
        made.append(Console(tmp_path, *options, protocol=PROTOCOL))
        return made[-1]

    yield begin
    for one in made:
        one.close()
