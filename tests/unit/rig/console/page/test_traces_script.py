"""What the page draws of the samples that its server sends, in a browser without one."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

import rigidimeter.rig.console.page as package
from rigidimeter.rig.console import AT_ONCE, TRACES, Traces
from rigidimeter.rig.console.page import points

ASSETS = Path(package.__file__).parent / "assets"
PLOTS = """
window.uPlot = class {
  constructor(options, data, at) {
    this.root = document.createElement("div");
    at.append(this.root);
  }
  setData() { window.drawn = true; }
  setSize() {}
  destroy() { this.root.remove(); }
};
"""


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    context = browser.new_context()
    made = context.new_page()
    made.set_content(
        "<body data-view=during><div id=panes></div><div id=epoch-panes></div>"
        f"<script>{PLOTS}{(ASSETS / 'traces.js').read_text('utf-8')}; rigTraces.begin();</script>"
    )
    yield made
    context.close()


def send(page: Page, drive_torque_nm: float) -> list[str]:
    """Send two pieces of time; return the titles of the panes once they are drawn."""
    values = {name: np.array([k, k + 0.5]) for k, name in enumerate(TRACES)}
    values["drive_torque_nm"] = np.full(2, drive_torque_nm)
    first = {name: np.full(2, math.nan) for name in AT_ONCE}
    traces = Traces(np.array([7.0, 7.1]), values, values, np.array([0, 0]), 0, first)
    page.evaluate(
        "(bytes) => { window.drawn = false; rigTraces.samples(new Uint8Array(bytes).buffer); }",
        list(points(traces, modelled=False)),
    )
    page.wait_for_function("window.drawn")
    return page.locator(".pane-title").all_text_contents()


def test_a_drive_that_reports_no_torque_has_no_pane(page):
    titles = send(page, math.nan)
    assert titles[0] == "torque [N·m]: 0.50"
    assert [title.partition(" [")[0] for title in titles[1:]] == [
        *("angle", "velocity command", "perturbation", "band torque"),
    ]


def test_the_drives_torque_has_a_pane_of_its_own_with_its_value(page):
    send(page, math.nan)
    titles = send(page, -3.25)
    assert titles[0] == "torque [N·m]: 0.50"
    assert titles[4] == "drive's torque [N·m]: -3.25"
    page.evaluate("rigTraces.task('sinusoid')")
    kept = page.locator(".pane-title").all_text_contents()
    assert [title.partition(" [")[0] for title in kept] == [
        *("torque", "angle", "velocity command", "drive's torque", "torque"),
    ]


def test_the_envelope_of_each_muscle_is_in_a_pane_where_there_is_emg(page):
    send(page, math.nan)
    points = [[7.0, 4.0, 12.5], [7.02, 4.25, 13.5]]
    sent = {"muscles": ["biceps", "triceps"], "points": points}
    page.evaluate("(sent) => rigTraces.emg(sent)", sent)
    (title,) = [one for one in send(page, math.nan) if one.startswith("EMG envelope [µV]")]
    assert title == "EMG envelope [µV]: — biceps: 4.25 – – triceps: 13.50"
    page.evaluate("(sent) => rigTraces.emg(sent)", sent | {"points": [[6.5, 1.0, 1.0]]})
    assert title in send(page, math.nan)  # what comes late is not the newest
    page.evaluate("rigTraces.clear()")
    page.evaluate("(sent) => rigTraces.emg(sent)", sent | {"points": [[6.0, 4.0, 12.5]]})
    send(page, math.nan)  # of 1.1 s later
    page.evaluate("(sent) => rigTraces.emg(sent)", sent | {"points": []})
    missing = "EMG envelope [µV]: — biceps – – triceps"
    assert missing in send(page, math.nan)
    page.evaluate("(sent) => rigTraces.emg(sent)", sent | {"points": [[6.9, 5.0, 6.0]]})
    assert "EMG envelope [µV]: — biceps: 5.00 – – triceps: 6.00" in send(page, math.nan)
    page.evaluate("rigTraces.task('sinusoid')")
    assert sum("EMG" in one for one in send(page, math.nan)) == 1
    page.evaluate("rigTraces.emg({ muscles: [], points: [] })")
    assert not any("EMG" in one for one in send(page, math.nan))
