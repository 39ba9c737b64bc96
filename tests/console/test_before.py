"""The page before a session: the steps of the rig, what is predicted, and other protocols."""

from __future__ import annotations

from playwright.sync_api import expect
from tests.console.opened import STARTS_S, assert_reached_by_tab, fill, open_page, wait_for

from rigidimeter.core.files import read_json

FOCUSED = "document.activeElement.textContent === 'No'"


def planned_on_the_page(page):
    """Press *Predict*, and return what it says of the days."""
    answer = page.locator("[data-name=computed]")
    page.get_by_role("button", name="Predict").click()
    answer.get_by_text("computing …").wait_for()
    answer.locator("li").first.wait_for(timeout=1e3 * STARTS_S)
    lines = answer.locator("li").all_text_contents()
    return [line for line in lines if line.startswith("To detect ")]


def planned_by_the_command(rigidimeter, protocol, *options):
    """Return what `design` says of the same differences."""
    numbers = protocol.with_name("numbers.json")
    wanted = ("--detect", "stiffness=20%", "--detect", "damping=20%")
    ran = rigidimeter("design", "--settings", protocol, *wanted, *options, "--json", numbers)
    assert ran.status == 0, ran.err
    return [one["sentence"] for one in read_json(numbers)["detection"]]


def test_before_a_session(console, chromium, rigidimeter):
    """By keyboard a check asks, consents to nothing by itself, and ends with Esc."""
    desk = console()
    protocol = (desk.place / "protocol.toml").read_text()
    both = protocol.replace("epochs = 2}", 'epochs = 2}, {task = "prbs", condition = "DBS"}')
    long = desk.place / "long.toml"
    long.write_text(both.replace("duration_s = 2.0", "duration_s = 3.0"))
    (desk.place / "wrong.toml").write_text("prbs.duration_s = -1.0\n")
    page = open_page(chromium, desk)
    for width in (390, 820):  # a telephone, a tablet
        page.set_viewport_size({"width": width, "height": 1180})
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        check = page.get_by_role("button", name="Check the rig")
        words = check.locator("xpath=ancestor::*[contains(@class, 'step')][1]")
        assert words.evaluate(
            "(step) => [...step.children].every((one) => one.scrollWidth <= one.clientWidth + 1)"
        )
    fill(page, "subject", "S01")
    fill(page, "operator", "Op")
    page.get_by_text("correction").wait_for(state="hidden")
    assert_reached_by_tab(page, "Start session")
    page.get_by_role("button", name="Check the rig").focus()
    page.keyboard.press("Enter")
    page.get_by_text("Nobody's arm may be in the rig").wait_for()
    page.wait_for_function(FOCUSED)
    assert page.locator("#emergency").is_enabled()
    page.keyboard.press("Escape")
    page.get_by_text("Nobody's arm may be in the rig").wait_for(state="hidden")
    page.get_by_text("not good").wait_for()
    page.wait_for_function("document.getElementById('emergency').disabled")

    page.get_by_text("Perturbation, controller and limits").click()
    fill(page, "prbs_duration", "6,5")
    page.get_by_role("button", name="Predict").focus()
    page.keyboard.press("Enter")
    page.get_by_text("The loop is stable; smallest margins").wait_for()
    page.get_by_text("OFF: 2 epochs give J ±").wait_for()

    page.get_by_label("Another protocol of").click()
    page.get_by_role("option", name="wrong.toml").click()
    page.get_by_text("The form is still that of protocol.toml").wait_for()
    page.get_by_label("Another protocol of").click()
    page.get_by_role("option", name="long.toml").click()
    page.get_by_text("Protocol: long.toml").wait_for()
    page.wait_for_function("document.body.dataset.view !== undefined")
    page.get_by_text("Perturbation, controller and limits").click()
    assert page.locator("input[data-field=prbs_duration]").input_value() == "3"
    assert page.locator("input[data-field=subject]").input_value() == "S01"

    # Without any SD between epochs in the protocol, page and command assume the same one.
    assert planned_on_the_page(page) == planned_by_the_command(rigidimeter, long)
    page.get_by_label("Primary measures of the study").click()
    page.get_by_role("option", name="stiffness, then damping").click()
    wait_for(lambda: '"stiffness, then damping"' in (desk.sessions / "draft.json").read_text())
    found = planned_on_the_page(page)
    assert found == planned_by_the_command(rigidimeter, long, "--rule", "sequence")
    assert "less damping after stiffness is shown (chance 80 %)" in found[1]
    assert "Assumed SD: 12 % between epochs (Table 2 of the paper)" in found[1]

    draft = desk.sessions / "draft.json"
    page.get_by_role("checkbox", name="Blinded").click()
    wait_for(lambda: '"yes"' in draft.read_text())
    page.reload()
    page.wait_for_function("document.body.dataset.view !== undefined")
    expect(page.get_by_role("checkbox", name="Blinded")).to_be_checked()
    draft.unlink()
    draft.mkdir()
    fill(page, "note", "of today")
    page.get_by_text("A reload would empty this form").wait_for()
    draft.rmdir()
    page.get_by_role("checkbox", name="Blinded").click()
    page.get_by_text("A reload would empty this form").wait_for(state="hidden")
