"""What the operator's page costs a session that runs: the loop's lateness, and memory over time.

lateness    of the loop on the virtual rig at 1 kHz, in sessions with the page open in Chromium and
            in unattended ones of `rigidimeter run`, in turns; of each pair the ratio of the medians
            and of the 99th percentiles, and the ticks that are missing in the records
memory      resident memory of the server's process and of the browser's renderers while epochs of a
            minute follow each other with the page open, and the slope of a straight line through
            it from the second minute on
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from numpy.typing import NDArray
from playwright.sync_api import Browser, Page
from tests.console.opened import Console, browser, open_page, start, wait_for

from rigidimeter.recording.sample_reading import read_samples

RUNS = "document.getElementById('state').textContent === 'epoch runs'"
SETTLES_S = 2.0
"""So much of the beginning of an epoch does not count: processes still start."""

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


def missing_ticks(ticks: NDArray[Any]) -> int:
    """Return how many ticks between the first and the last are not in the record."""
    return int(ticks[-1] - ticks[0]) + 1 - int(np.unique(ticks).size)


def lateness_of(folder: Path) -> tuple[float, float, int]:
    """Return median and 99th percentile of the lateness in s, and how many ticks are missing."""
    samples = read_samples(folder / "samples.arrows")
    running = samples["epoch"] >= 0
    counted = running & (samples["time_s"] > samples["time_s"][running][0] + SETTLES_S)
    late_s = samples["lateness_s"][counted]
    median_s, p99_s = np.percentile(late_s, [50, 99])
    return float(median_s), float(p99_s), missing_ticks(samples["tick"])


def lateness(runs: int, seconds: float) -> None:
    """Compare the loop's lateness with and without the page; print a row for each pair."""
    rows = []
    print(
        "| median, page | without | ratio | p99, page | without | ratio | missing, page | without |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        protocol = PROTOCOL.format(seconds=seconds, epochs=1)
        console = Console(folder, protocol=protocol)
        try:
            with browser() as opened:
                for run in range(runs):
                    found = {}
                    for open_now in (True, False) if run % 2 else (False, True):
                        found[open_now] = (
                            _with_page(opened, console)
                            if open_now
                            else _without(folder / "protocol.toml", folder / f"alone-{run}")
                        )
                    rows.append((found[True], found[False]))
                    print(_row(*rows[-1]), flush=True)
        finally:
            console.close()
    for which, what in ((0, "medians"), (1, "99th percentiles")):
        ratios = [page[which] / alone[which] for page, alone in rows]
        print(f"ratio of the {what}: median of the pairs {np.median(ratios):.2f}")


def _with_page(opened: Browser, console: Console) -> tuple[float, float, int]:
    page = open_page(opened, console)
    renew(page, console)
    assert console.ended()["outcome"] == "success"
    page.wait_for_function("document.body.dataset.view === 'after'")
    page.context.close()
    return lateness_of(console.folder())


def _without(protocol: Path, out: Path) -> tuple[float, float, int]:
    command = [sys.executable, "-m", "rigidimeter", "run", str(protocol), "--out", str(out)]
    subprocess.run([*command, "--unattended"], check=True, stdout=subprocess.DEVNULL)
    return lateness_of(out)


def _row(page: tuple[float, float, int], alone: tuple[float, float, int]) -> str:
    cells = []
    for which in (0, 1):
        cells += [f"{1e6 * page[which]:.0f} µs", f"{1e6 * alone[which]:.0f} µs"]
        cells.append(f"{page[which] / alone[which]:.2f}")
    return f"| {' | '.join([*cells, str(page[2]), str(alone[2])])} |"


def memory(minutes: float) -> None:
    """Follow the resident memory while a session runs with the page open; print a table."""
    times_s: list[float] = []
    found: dict[str, list[float]] = {"server": [], "renderer": []}
    epochs = max(1, int(minutes * 60.0 / 62.0))
    with tempfile.TemporaryDirectory() as name:
        console = Console(Path(name), protocol=PROTOCOL.format(seconds=60.0, epochs=epochs))
        try:
            with browser() as opened:
                page = open_page(opened, console)
                renew(page, console)
                begun_s = time.monotonic()
                pids = {"server": [console.process.pid], "renderer": renderers(opened)}
                while console.events()[-1]["event"] != "session_ended":
                    times_s.append(time.monotonic() - begun_s)
                    for what, of in pids.items():
                        found[what].append(sum(psutil.Process(pid).memory_info().rss for pid in of))
                    page.wait_for_timeout(1e3 * LOOK_S)
                ended = console.ended()
                print(f"the session ended: {ended['outcome']} {ended['reason'] or ''}")
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
