"""A blinded session of a plan on the page, from its wait to the next one that is due."""

from __future__ import annotations

from playwright.sync_api import expect
from tests.console.opened import STARTS_S, Console, open_page
from tests.console.operator_day import command, leave_out, opened_session, over

from rigidimeter.core.session import read_manifest
from rigidimeter.core.study_files import read_study_folder

SHARED = """
rig = {tick_rate_hz = 250.0, torque = {rate_hz = 250.0}, motion = {rate_hz = 250.0}}
prbs.duration_s = 2.0
protocol.rests_s = [1.0]
protocol.return_s = 0.5
zeroing.duration_s = 0.5
"""
NAMES = ("Zebra", "Quagga")


def test_a_blinded_session_of_a_plan(chromium, tmp_path):
    """No screen of the page or its terminal names a condition, before, during and after it."""
    study = tmp_path / "sessions"
    shared = tmp_path / "shared.toml"
    shared.write_text(SHARED)
    ran = command(
        "study", "plan", study, "--subjects", "S01", "--days", 1, "--conditions", "Zebra,Quagga",
        "--order", "Quagga,Zebra", "--prbs-epochs", 1, "--sinusoid-epochs", 0, "--raters", "A,B",
        "--blinded", "--settings", shared,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stderr
    seen = [ran.stdout, ran.stderr]
    desk = Console(tmp_path, "--clock-speed", "60000")
    try:
        page = open_page(chromium, desk)
        page.get_by_text("Session 1 of 2 of S01: day 1, number 1, code-").wait_for()
        page.get_by_text("The wait of 60 min has not begun").wait_for()
        start = page.get_by_role("button", name="Start session")
        expect(start).to_be_disabled()
        page.get_by_text("A session outside the plan").click()
        page.get_by_role("button", name="Start outside the plan").wait_for()
        page.get_by_text("write a code of the plan: code-A, code-B").first.wait_for()
        seen.append(page.content())
        page.get_by_text("A session outside the plan").click()
        # Whoever sets the stimulator is not blinded.
        assert command("study", "stimulation", study, "on").returncode == 0
        page.get_by_text("No wait is left").wait_for()
        page.locator("input[data-field=operator]").first.fill("Kim")
        start.click()
        page.wait_for_function("window.rigDrawnS > 0", timeout=1e3 * STARTS_S)
        expect(page.locator("#examiner")).to_have_attribute("placeholder", "planned: A, B")
        expect(page.locator("#condition")).to_contain_text("code-")
        seen.append(page.content())
        seen.append(over(page, "success"))
        assert "Next: Session 2 of 2 of S01: day 1, number 2, code-" in seen[-1]
        session = opened_session(page, "sessions/S01-day-1-1")
        leave_out(page, session, "1", "coughed", "Kim")
        seen.append(page.content())
        page.get_by_role("button", name="Before", exact=True).click()
        page.get_by_text("Session 2 of 2 of S01: day 1, number 2, code-").first.wait_for()
        seen.append(page.content())
    finally:
        desk.close()
    seen += desk.said
    about = read_manifest(study / "sessions/S01-day-1-1")["about"]
    place = about["plan"]
    assert (place["condition"], place["clock_speed"], about["operator"]) == ("Quagga", 60000, "Kim")
    assert place["since_change_min"] >= place["wait_min"] == 60.0
    found = read_study_folder(study)
    assert [(row["path"], row["condition"]) for row in found.sessions] == [
        ("sessions/S01-day-1-1", "Quagga")
    ]
    assert [(row["path"], row["epoch"]) for row in found.exclusions] == [
        ("sessions/S01-day-1-1", "1")
    ]
    for screen in seen:
        assert not any(name in screen for name in NAMES)
