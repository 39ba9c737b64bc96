"""A plan of days is drawn on the page, and its first session is run there."""

from __future__ import annotations

import csv

from playwright.sync_api import expect
from tests.console.opened import STARTS_S, Console, fill, open_page
from tests.console.operator_day import over
from tests.console.test_planned_page import SHARED

from rigidimeter.core.session import read_manifest


def test_a_plan_of_three_days_is_drawn_and_its_first_session_run(chromium, tmp_path):
    desk = Console(tmp_path, "--clock-speed", "60000", protocol=SHARED)
    try:
        page = open_page(chromium, desk)
        page.get_by_text("Plan the days").click()
        entered = {
            "subjects": "S01", "days": "three", "prbs_epochs": "1", "sinusoid_epochs": "0",
            "raters": "A,B",
        }  # fmt: skip
        for key, value in entered.items():
            fill(page, f"plan_{key}", value)
        page.get_by_label("Order in a day").click()
        page.get_by_role("option", name="given").click()
        fill(page, "plan_given", "DBS,OFF")
        page.get_by_role("button", name="30 min").click()
        page.get_by_text("some of the effect may be left").wait_for()
        page.get_by_role("button", name="Draw the plan").click()
        page.get_by_text("'three' is no number").wait_for()
        fill(page, "plan_days", "3")
        page.get_by_role("button", name="Draw the plan").click()
        page.get_by_text("6 sessions on 3 days, 2 h of waits, order given").wait_for()
        rows = page.locator("#view-before .plan tbody tr")
        expect(rows).to_have_count(6)
        expect(rows.nth(1)).to_have_text("12OFFprbs30A B")
        assert not (desk.sessions / "plan.csv").exists()
        page.get_by_role("button", name="Write this plan").click()

        page.get_by_text("Session 1 of 6 of S01: day 1, number 1, DBS, rated by A, B").wait_for()
        with (desk.sessions / "plan.csv").open() as table:
            planned = list(csv.DictReader(table))
        assert [row["condition"] for row in planned] == ["DBS", "OFF"] * 3
        page.wait_for_function("document.body.dataset.view === 'before'", timeout=1e3 * STARTS_S)
        fill(page, "stimulation", "on")
        page.get_by_role("button", name="Enter the change").click()
        page.get_by_text("No wait is left").wait_for()
        fill(page, "operator", "Kim")
        page.get_by_role("button", name="Start session").click()
        said = over(page, "success")
        assert "1 of 1 epochs completed" in said
        assert "Next: Session 2 of 6 of S01: day 1, number 2, OFF" in said
    finally:
        desk.close()
    about = read_manifest(desk.sessions / "sessions/S01-day-1-1")["about"]
    assert (about["subject"], about["operator"], about["plan"]["condition"]) == (
        "S01",
        "Kim",
        "DBS",
    )
    assert about["plan"]["since_change_min"] >= about["plan"]["wait_min"] == 15.0
