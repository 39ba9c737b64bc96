"""How soon the operator's page stops the arm, and how far its traces are behind.

`python -m benchmarks.console --clicks 30 --freezes 5` opens the page in Debian's Chromium over the
real loop on the virtual rig, at 1 kHz with five panes live. Each stop is a session of its own:

click       from the time stamp of the pointer event in the browser to the first recorded tick with
            the cause and a velocity command of zero
watching    the same, of a page that only watches
freeze      from SIGSTOP to all renderers of the browser to the first recorded tick with the cause,
            and to the first with a velocity command of zero
behind      from the newest sample on the screen to now, looked at by the page
server      share of one processor that the server's process took while the epoch ran

left out    ticks that the loop left out of a session because it was late
lost        samples that the loop made and the recorder lost, of a session

The browser's clock is the wall clock; its difference to CLOCK_MONOTONIC is read beside each click.

`python -m benchmarks.console lateness --pairs 20` compares the loop's lateness with the page and
without it (`benchmarks.console_lateness`), and `python -m benchmarks.console memory --minutes 20`
follows the memory of server and browser (`benchmarks.console_running`).
"""

from __future__ import annotations

import argparse
import os
import signal
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from playwright.sync_api import Browser, Page
from tests.browser import open_browser
from tests.console.opened import Console, open_page

from benchmarks.console_gaps import gaps
from benchmarks.console_lateness import lateness
from benchmarks.console_running import memory, renderers, renew
from rigidimeter.core.session import read_samples
from rigidimeter.rig.guard import Cause

RATE_HZ = 1000.0

PROTOCOL = f"""
rig.tick_rate_hz = {RATE_HZ}
prbs.duration_s = 60.0
protocol.rests_s = [2.0]
protocol.return_s = 1.0
protocol.blocks = [{{task = "prbs", condition = "OFF", epochs = 1}}]
zeroing.duration_s = 0.2
"""
NOTE_CLICK = """addEventListener("pointerdown", (event) => {
  window.clickedS = (performance.timeOrigin + event.timeStamp) / 1000; }, true)"""
BEHIND = "[(performance.timeOrigin + performance.now()) / 1000, window.rigDrawnS]"


def begin(page: Page, measured: dict[str, list[float]], console: Console) -> float:
    """Start a session; return when it began on CLOCK_MONOTONIC, 2 s into its epoch."""
    renew(page, console)
    started = next(e for e in console.events() if e["event"] == "clock_started")
    origin_s = float(started["monotonic_s"])
    server = psutil.Process(console.process.pid)
    server.cpu_percent()
    for _ in range(20):
        page.wait_for_timeout(100)
        wall_s, drawn_s = page.evaluate(BEHIND)
        measured["behind"].append(monotonic_s(wall_s) - origin_s - drawn_s)
    measured["server"].append(server.cpu_percent() / 100)
    return origin_s


def monotonic_s(wall_s: float) -> float:
    """Return a time of the wall clock on CLOCK_MONOTONIC."""
    return wall_s + time.monotonic() - time.time()


def stopped_s(
    console: Console, cause: Cause, measured: dict[str, list[float]]
) -> tuple[float, float]:
    """Return the session times of the first tick with the cause, and with a command of zero."""
    reason = console.ended()["reason"]
    assert cause.sentence in reason, reason
    samples: dict[str, Any] = read_samples(console.folder() / "samples.arrows")
    missing = gaps(samples["tick"], samples["lateness_s"], RATE_HZ)
    measured["left out"].append(float(missing.left_out))
    measured["lost"].append(float(missing.lost))
    latched = samples["cause"] == int(cause)
    at_rest = latched & (samples["velocity_command_rad_s"] == 0.0)
    return float(samples["time_s"][latched][0]), float(samples["time_s"][at_rest][0])


def click(
    page: Page, console: Console, measured: dict[str, list[float]], watching: Page | None = None
) -> None:
    """Click on the emergency stop once, of the page in control or of one that watches."""
    origin_s = begin(page, measured, console)
    on = watching or page
    on.evaluate(NOTE_CLICK)
    on.locator("#emergency").click()
    clicked_s = monotonic_s(on.evaluate("window.clickedS"))
    _, zero_s = stopped_s(console, Cause.EMERGENCY_STOP, measured)
    measured["watching" if watching else "click"].append(origin_s + zero_s - clicked_s)
    page.wait_for_function("document.body.dataset.view === 'after'")


def freeze(opened: Browser, page: Page, console: Console, measured: dict[str, list[float]]) -> None:
    """Stop the renderer once."""
    origin_s = begin(page, measured, console)
    pids = renderers(opened)
    frozen_s = time.monotonic()
    for pid in pids:
        os.kill(pid, signal.SIGSTOP)
    try:
        named_s, zero_s = stopped_s(console, Cause.CONSOLE_LOST, measured)
    finally:
        for pid in pids:
            os.kill(pid, signal.SIGCONT)
    measured["frozen, cause"].append(origin_s + named_s - frozen_s)
    measured["frozen, zero"].append(origin_s + zero_s - frozen_s)
    page.wait_for_function("document.body.dataset.view === 'after'")


def row(name: str, values: list[float]) -> str:
    """Return a line of the table: median, 95th percentile, largest, how many."""
    if not values:
        return f"| {name} | – | – | – | 0 |"
    shown = (np.median(values), np.percentile(values, 95), max(values))
    if name in ("left out", "lost"):
        cells = [f"{value:.0f}" for value in shown]
    elif name == "server":
        cells = [f"{100 * value:.0f} %" for value in shown]
    else:
        cells = [f"{1e3 * value:.0f} ms" for value in shown]
    return f"| {name} | {' | '.join(cells)} | {len(values)} |"


def stops(clicks: int, freezes: int) -> None:
    """Measure how soon the page stops the arm, and print a table."""
    names = (
        "click",
        "watching",
        "frozen, cause",
        "frozen, zero",
        "behind",
        "server",
        "left out",
        "lost",
    )
    measured: dict[str, list[float]] = {name: [] for name in names}
    with tempfile.TemporaryDirectory() as name:
        console = Console(Path(name), protocol=PROTOCOL)
        try:
            with open_browser() as opened:
                page = open_page(opened, console)
                for _ in range(clicks):
                    click(page, console, measured)
                watching = open_page(opened, console)
                for _ in range(clicks):
                    click(page, console, measured, watching)
                watching.close()
                for _ in range(freezes):
                    freeze(opened, page, console, measured)
        finally:  # also of a study that was ended early
            console.close()
            print("| | median | 95 % | largest | n |\n| --- | --- | --- | --- | --- |")
            for what, values in measured.items():
                print(row(what, values))


def main() -> None:
    """Measure what is asked for and print it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mode", nargs="?", choices=("stops", "lateness", "memory"), default="stops")
    parser.add_argument("--clicks", type=int, default=30)
    parser.add_argument("--freezes", type=int, default=5)
    parser.add_argument("--pairs", type=int, default=20, help="of windows of `lateness`")
    parser.add_argument("--seconds", type=float, default=4.0, help="of each window")
    parser.add_argument("--minutes", type=float, default=20.0, help="of `memory`")
    parser.add_argument("--rows", default="", help="CSV file for what `memory` reads")
    asked = parser.parse_args()
    if asked.mode == "stops":
        stops(asked.clicks, asked.freezes)
    elif asked.mode == "lateness":
        lateness(asked.pairs, asked.seconds)
    else:
        memory(asked.minutes, asked.rows)


if __name__ == "__main__":
    main()
