"""What memory the operator's page takes while sessions run on it.

That is the resident memory of the server's process and of the browser's renderers while sessions of
epochs of a minute follow each other with the page open; printed is the slope of a straight line
through it, from the second minute on. A session that ends early, on a machine that was too busy to
hear the page in time, is said and followed by another.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
import psutil
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page
from tests.console.opened import Console, browser, open_page, start, wait_for

RUNS = "document.getElementById('state').textContent === 'epoch runs'"
LOOK_S = 5.0
BEGINS_S = 120.0
"""From here on memory counts."""

TWO_HOURS_S = 7200.0

PROTOCOL = """
prbs.duration_s = {seconds}
protocol.rests_s = [2.0]
protocol.return_s = 1.0
protocol.blocks = [{{task = "prbs", condition = "OFF", epochs = {epochs}}}]
zeroing.duration_s = 0.2
"""


def renew(page: Page, console: Console) -> None:
    """Start a session from the page; return when its first epoch runs."""
    page.locator(".tab[data-view=before]").click()
    before = set(console.sessions.glob("*/manifest.json"))
    start(page)
    wait_for(lambda: set(console.sessions.glob("*/manifest.json")) - before)
    page.wait_for_function(RUNS)


def renderers(opened: Browser) -> list[int]:
    """Return the processes of the browser that show pages."""
    found = opened.new_browser_cdp_session().send("SystemInfo.getProcessInfo")
    return [one["id"] for one in found["processInfo"] if one["type"] == "renderer"]


def memory(minutes: float) -> None:
    """Follow the resident memory while sessions run with the page open; print a table."""
    times_s: list[float] = []
    found: dict[str, list[float]] = {"server": [], "renderer": []}
    epochs = max(1, int(minutes * 60.0 / 62.0))
    with tempfile.TemporaryDirectory() as name:
        console = Console(Path(name), protocol=PROTOCOL.format(seconds=60.0, epochs=epochs))
        try:
            with browser() as opened:
                page = open_page(opened, console)
                pids = {"server": [console.process.pid], "renderer": renderers(opened)}
                begun_s = time.monotonic()
                until_s = begun_s + 60.0 * minutes
                while time.monotonic() < until_s:
                    renew(page, console)
                    while console.leads_session() and time.monotonic() < until_s:
                        times_s.append(time.monotonic() - begun_s)
                        for what, of in pids.items():
                            sizes = (psutil.Process(pid).memory_info().rss for pid in of)
                            found[what].append(sum(sizes))
                        page.wait_for_timeout(1e3 * LOOK_S)
                    if not console.leads_session():
                        ended = console.ended()
                        print(f"a session ended: {ended['outcome']} {ended['reason']}", flush=True)
        finally:  # also of a study that was ended early
            console.close()
            _print_memory(np.array(times_s), found)


def _print_memory(times_s: NDArray[np.float64], found: dict[str, list[float]]) -> None:
    counted = times_s >= BEGINS_S
    if np.count_nonzero(counted) < 3:
        print(f"shorter than the {BEGINS_S:g} s after which memory counts")
        return
    print("| | after 2 min | at the end | slope in 2 h | ± 95 % | minutes |")
    print("| --- | --- | --- | --- | --- | --- |")
    for what, values in found.items():
        size_mb = np.array(values)[counted] / 1e6
        of_s = times_s[counted]
        line, covariance = np.polyfit(of_s, size_mb, 1, cov=True)
        slope, wide = TWO_HOURS_S * line[0], TWO_HOURS_S * 1.96 * float(np.sqrt(covariance[0, 0]))
        cells = [
            f"{size_mb[0]:.0f} MB",
            f"{size_mb[-1]:.0f} MB",
            f"{slope:+.0f} MB",
            f"{wide:.0f} MB",
        ]
        print(f"| {what} | {' | '.join(cells)} | {of_s[-1] / 60:.0f} |")
