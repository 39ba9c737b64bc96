"""An operator's day on the page: interrupted, repeated, killed, and read as a study at its end."""

from __future__ import annotations

import re
from datetime import date

import numpy as np
import pytest
from playwright.sync_api import expect
from tests.console.opened import Console, fill, open_page, start
from tests.console.operator_day import (
    click_and_run,
    command,
    in_epoch,
    kill_all,
    leave_out,
    opened_session,
    over,
    rate,
    study_report,
)

from rigidimeter.core.session import read_manifest, read_samples
from rigidimeter.core.study_files import declared_primary, read_study_folder

PROTOCOL = """
rig = {{tick_rate_hz = 250.0, torque = {{rate_hz = 250.0}}, motion = {{rate_hz = 250.0}}}}
prbs.duration_s = {epoch_s}
protocol.rests_s = [3.0]
protocol.return_s = 1.0
protocol.blocks = [
  {{task = "prbs", condition = "OFF", epochs = {off}}},
  {{task = "prbs", condition = "DBS", epochs = {dbs}}},
]
zeroing.duration_s = 0.5
loop.stall_s = 0.2
"""
INTERVAL = re.compile(r"\[[\d.]+ to [\d.]+\]")


@pytest.fixture
def console(tmp_path):
    """Start consoles on the virtual rig; all use one folder of sessions."""
    made = []

    def begin(off: int, dbs: int, epoch_s: float = 6.0) -> Console:
        text = PROTOCOL.format(off=off, dbs=dbs, epoch_s=epoch_s)
        made.append(Console(tmp_path, protocol=text))
        return made[-1]

    yield begin
    for one in made:
        one.close()


def sound_study(page, sound):
    """Make the report by its button; K of both is on its first screen. Return its verdict."""
    report = study_report(page)
    for name in ("OFF", "DBS"):
        table = report.locator("#summary table").filter(has_text=f"All epochs in {name} together")
        stiffness = table.locator("tr").filter(has_text="Stiffness K")
        assert INTERVAL.search(stiffness.text_content()), stiffness.text_content()
        assert stiffness.locator("[data-name=epochs]").text_content() == str(sound[name])
    return " ".join(report.locator("p.verdict").text_content().split())


def recorded(folder):
    """Return the samples of a session, of which no tick is there twice and none is out of order."""
    samples = read_samples(folder / "samples.arrows")
    assert np.all(np.diff(samples["tick"]) >= 1)
    assert np.diff(samples["time_s"]).max() < 0.2  # a longer wait stops the arm
    return samples


@pytest.mark.slow  # always: `test_page` kills the server, `tests/faults` the processes, by signals
def test_all_processes_are_killed_and_a_new_page_runs_the_rest(console, chromium):
    """What was recorded is whole; the rest is run from a new page; the folder is a study."""
    desk = console(1, 1, 3.0)
    page = open_page(chromium, desk)
    page.get_by_label("Primary measures of the study").click()
    page.get_by_role("option", name="stiffness", exact=True).click()
    start(page)
    declared = declared_primary(desk.sessions)
    assert (declared.measures, declared.declared) == (["stiffness_nm_rad"], date.today())
    in_epoch(page, "2 of 2")
    kill_all(desk)
    broken = desk.folder()
    ended_s = next(e["time_s"] for e in desk.events() if e["event"] == "epoch_ended")
    page.close()
    desk = console(1, 1, 3.0)
    page = open_page(chromium, desk)
    page.get_by_text(f"{broken.name}: 1 of 2 epochs are good, it was interrupted").wait_for()
    page.get_by_text(f"Primary measures: stiffness, declared {date.today()}").wait_for()
    session = opened_session(page, broken.name)
    session.get_by_role("button", name="Recover").click()
    page.get_by_text("is closed: ").wait_for()
    assert recorded(broken)["time_s"][-1] > ended_s
    session = opened_session(page, broken.name)
    rest = click_and_run(desk, page, session, "Run what is left: 1")
    assert "Report of the study" in over(page, "success")
    assert read_manifest(rest)["continues"]["folder"] == broken.name
    study = read_study_folder(desk.sessions)
    rows = {(row["path"], row["condition"], row["part"]) for row in study.sessions}
    assert rows == {(broken.name, "OFF", ""), (broken.name, "DBS", ""), (rest.name, "DBS", "2")}
    assert declared_primary(desk.sessions) == declared


@pytest.mark.slow
def test_a_day_with_a_stop_a_repetition_and_a_restart(console, chromium):
    """Every button of After is clicked; the report of the page is that of the terminal."""
    desk = console(3, 3)
    page = open_page(chromium, desk)
    page.get_by_text("Stimulation (leave empty").click()
    fill(page, "stim_frequency", "130")
    fill(page, "stim_ma", "2,5")
    start(page)
    rate(page, 1, "2")
    in_epoch(page, "2 of 6")
    page.keyboard.press("Escape")
    said = over(page, "fail")
    assert "Run what is left" in said
    assert "rigidimeter" not in said.replace("rigidimeter-", "")
    first = desk.folder()

    session = opened_session(page, first.name)
    second = click_and_run(desk, page, session, "Run what is left: 5")
    rate(page, 2, "1,5")
    in_epoch(page, "3 of 6")
    page.get_by_role("button", name="Stop after epoch").click()
    over(page, "success")

    session = opened_session(page, first.name)
    again = click_and_run(desk, page, session, "Repeat")
    over(page, "success")
    leave_out(page, opened_session(page, first.name), "1", "coughed", "Op")

    session = opened_session(page, second.name)
    third = click_and_run(desk, page, session, "Run what is left: 3")
    rate(page, 4, "1")
    in_epoch(page, "5 of 6")
    kill_all(desk)
    page.close()
    desk = console(3, 3)
    page = open_page(chromium, desk)
    page.get_by_text(f"{third.name}: 1 of 3 epochs are good, it was interrupted").wait_for()
    session = opened_session(page, third.name)
    session.get_by_role("button", name="Recover").click()
    page.get_by_text("is closed: ").wait_for()
    recorded(third)
    session = opened_session(page, third.name)
    fourth = click_and_run(desk, page, session, "Run what is left: 2")
    rate(page, 5, "0,5")
    over(page, "success")
    expect(page.get_by_role("button", name="Run what is left")).to_have_count(0)

    session = opened_session(page, fourth.name)
    session.get_by_role("button", name="Estimate").click()
    expect(page.locator("#view-after .answer")).to_contain_text("N·m/rad", timeout=60e3)
    verdict = sound_study(page, {"OFF": 3, "DBS": 3})
    ran = command("report", desk.sessions, "--out", desk.sessions / "report")
    assert ran.returncode == 0, ran.stderr
    assert " ".join(ran.stdout.split()).startswith(verdict)
    study = read_study_folder(desk.sessions)
    assert {row["path"] for row in study.sessions} == {
        one.name for one in (first, second, again, third, fourth)
    }
    assert [(row["condition"], row["score"]) for row in study.ratings] == [
        ("OFF", "2"), ("OFF", "1.5"), ("DBS", "1"), ("DBS", "0.5"),
    ]  # fmt: skip
    assert [row["reason"] for row in study.exclusions] == ["coughed"]
    assert study.about.conditions["DBS"].frequency_hz == 130.0
    assert {read_manifest(one)["about"]["subject"] for one in (second, again, third, fourth)} == {
        "S01"
    }
