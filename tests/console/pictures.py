"""Pictures of an operator's day for its tutorial: `python -m tests.console.pictures FOLDER`.

The day runs on the virtual rig in real time and takes about three minutes.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page
from tests.console.opened import Console, browser, fill, open_page, start
from tests.console.operator_day import (
    click_and_run,
    in_epoch,
    kill_all,
    opened_session,
    over,
    rate,
    study_report,
)

PROTOCOL = """
prbs.duration_s = 8.0
protocol.rests_s = [3.0]
protocol.return_s = 1.0
loop.stall_s = 0.2
rig = {tick_rate_hz = 250.0, torque = {rate_hz = 250.0}, motion = {rate_hz = 250.0}}
protocol.blocks = [
  {task = "prbs", condition = "OFF", epochs = 3},
  {task = "prbs", condition = "DBS", epochs = 3},
]
"""
WIDTH, HEIGHT, REPORT_HEIGHT = 1100, 860, 1080
COLOURS = 256
SEEN_MS = 6000
"""After that time in an epoch J, B and K are shown."""


def take(page: Page, folder: Path, name: str, height: int = HEIGHT) -> None:
    """Take a picture of what is seen without scrolling."""
    page.set_viewport_size({"width": WIDTH, "height": height})
    page.wait_for_timeout(400)
    path = folder / f"{name}.png"
    page.screenshot(path=path)
    with Image.open(path) as taken:
        small = taken.convert("RGB").quantize(COLOURS, Image.Quantize.FASTOCTREE)
    small.save(path, optimize=True)


def pictures(folder: Path, sessions: Path) -> None:
    """Run the day and take its pictures."""
    desk = Console(sessions, protocol=PROTOCOL)
    with browser() as opened:
        page = open_page(opened, desk)
        page.get_by_text("Stimulation (leave empty").click()
        for key, value in {"subject": "S01", "operator": "Kim", "stim_frequency": "130",
                           "stim_ma": "2,5", "stim_width": "60"}.items():  # fmt: skip
            fill(page, key, value)
        page.wait_for_timeout(1000)
        take(page, folder, "form")
        start(page, operator="Kim")
        in_epoch(page, "1 of 6")
        page.wait_for_timeout(SEEN_MS)
        take(page, folder, "epoch")
        rate(page, 1, "2")
        in_epoch(page, "2 of 6")
        page.keyboard.press("Escape")
        over(page, "fail")
        first = desk.folder()
        session = opened_session(page, first.name)
        session.get_by_role("button", name="Estimate").hover()
        take(page, folder, "stopped")
        second = click_and_run(desk, page, session, "Run what is left: 5")
        rate(page, 2, "2")
        in_epoch(page, "3 of 6")
        kill_all(desk)
        page.close()
        desk = Console(sessions, protocol=PROTOCOL)
        page = open_page(opened, desk)
        take(page, folder, "restarted")
        opened_session(page, second.name).get_by_role("button", name="Recover").click()
        page.get_by_text("is closed: ").wait_for()
        session = opened_session(page, second.name)
        click_and_run(desk, page, session, "Run what is left: 4")
        for place, score in enumerate(("2", "1,5", "1", "1,5"), start=3):
            rate(page, place, score)
        over(page, "success")
        session = opened_session(page, first.name)
        session.get_by_role("button", name="Leave out").first.click()
        page.locator("input[data-field=reason]").fill("coughed")
        page.locator("input[data-field=by]").fill("Kim")
        take(page, folder, "leave-out")
        page.get_by_role("dialog").get_by_role("button", name="Leave out").click()
        click_and_run(desk, page, session, "Repeat")
        over(page, "success")
        take(study_report(page), folder, "report", REPORT_HEIGHT)
    desk.close()


if __name__ == "__main__":
    out = Path(sys.argv[1])
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="operator-day-") as name:
        pictures(out, Path(name))
