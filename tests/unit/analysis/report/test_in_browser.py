"""The page as a browser shows and prints it: nothing is cut, every link leads somewhere."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Page
from tests.unit.analysis.report.cohorts import Design, made_study
from tests.unit.analysis.report.parsed_page import sections_without

from rigidimeter.analysis.report import Shown, report
from rigidimeter.analysis.study import analysis_study, conclude_study

DESKTOP, PHONE = (1280, 800), (390, 844)
SCREENS = Path(__file__).parents[4] / "build" / "screens"
READY_MS = 5000
"""Of a small page on a machine that does other work too."""
LONG = ("perturbation", "torque", "voluntary", "loops", "impedance", "recorded")
"""Figures of recordings, which take long to draw."""


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Return the pages of a study and of one condition."""
    study = made_study(Design(days=(9, 4), epochs=(3, 3), scores=(2, 2)))
    one = conclude_study(analysis_study(study.analysis, ("OFF", "")), resamples=0)
    results = {"study": study, "one": Shown(one, study.epochs, title="One recording")}
    with sections_without(LONG):
        return {
            name: report(result, tmp_path_factory.mktemp(name)) for name, result in results.items()
        }


@pytest.fixture(scope="module")
def on_a_desk(browser: Browser, reports: dict[str, Path]) -> Iterator[Page]:
    """Return the page of the study, opened once; a test leaves it as it was."""
    page = opened(browser, reports["study"], DESKTOP)
    yield page
    page.close()


def opened(browser: Browser, path: Path, size: tuple[int, int]) -> Page:
    page = browser.new_page(viewport={"width": size[0], "height": size[1]})
    page.goto(path.as_uri())
    return page


@pytest.mark.parametrize("size", [DESKTOP, PHONE])
@pytest.mark.parametrize("name", ["study", "one"])
def test_the_first_screen_holds_stiffness_and_the_traffic_light(
    browser: Browser, reports: dict[str, Path], name: str, size: tuple[int, int]
) -> None:
    page = opened(browser, reports[name], size)
    SCREENS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=SCREENS / f"{name}-{size[0]}.png")
    measure = re.compile(r"^\s*K, N·m/rad" if name == "study" else "Stiffness K")
    row = page.locator(".strip tbody tr").filter(has_text=measure)
    shown = (page.locator(".verdict"), page.locator(".light"), row)
    for part in shown:
        box = part.bounding_box()
        assert box is not None
        assert box["y"] >= 0
        assert box["y"] + box["height"] <= size[1]
        assert box["x"] + box["width"] <= size[0]
    ends = r"−\d+ to −\d+ %" if name == "study" else r"[\d.]+ to [\d.]+"
    assert re.search(ends, row.inner_text())
    assert row.locator("svg.interval").is_visible()
    assert "Data quality: good" in page.locator(".light").inner_text()
    # Nothing is cut at the side.
    assert page.evaluate("document.documentElement.scrollWidth") <= size[0]
    strip = page.locator(".scroll:has(> .strip)")
    assert not strip.evaluate("one => one.scrollWidth > one.clientWidth")
    page.close()


def test_the_figures_of_the_days_are_as_wide_as_the_page(on_a_desk: Page) -> None:
    wide = on_a_desk.locator("main").evaluate("one => one.clientWidth")
    figures = on_a_desk.locator("#days svg").all()
    assert len(figures) == 5
    for figure in figures:
        box = figure.bounding_box()
        assert box is not None
        assert box["width"] == pytest.approx(wide, abs=1)


def test_every_link_leads_somewhere(on_a_desk: Page, reports: dict[str, Path]) -> None:
    page = on_a_desk
    links = page.locator("a").evaluate_all("all => all.map(a => a.getAttribute('href'))")
    assert len(links) > 30
    for link in links:
        if not link.startswith("#"):
            assert (reports["study"].parent / link).is_file(), link
    for entry in page.locator("nav a").all():
        entry.click()
        target = page.locator(str(entry.get_attribute("href")))
        box = target.bounding_box()
        assert box is not None
        assert -1 <= box["y"] < DESKTOP[1], entry.inner_text()


def test_the_print_is_the_first_parts_with_page_numbers(
    on_a_desk: Page, reports: dict[str, Path]
) -> None:
    page = on_a_desk

    def pages() -> int:
        return len(re.findall(rb"/Type\s*/Page\b", page.pdf(prefer_css_page_size=True)))

    first = pages()
    assert 2 <= first <= 11
    page.locator("#everything").check()
    page.locator("details.long").evaluate_all("all => all.forEach(one => one.open = true)")
    assert pages() > first
    assert "counter(page)" in reports["study"].read_text(encoding="utf-8")
    page.locator("#everything").uncheck()
    page.reload()


def test_the_print_has_rig_settings_and_provenance_and_names_what_is_not_in_it(
    on_a_desk: Page,
) -> None:
    page = on_a_desk
    page.emulate_media(media="print")
    chapters = [one for one in page.locator("h2").all_inner_texts() if one]
    assert {"What was done", "Rig checks", "Epoch quality", "Provenance"} <= set(
        one.strip("?") for one in chapters
    )
    for shown in ("#design table:has-text('Estimation')", "#provenance table"):
        assert page.locator(shown).is_visible(), shown
    # What is folded on a screen cannot be unfolded on paper.
    assert page.locator("#exclusions td", has_text="the animal moved").is_visible()
    assert page.locator("#design details td").first.is_visible()
    left_out = page.locator("footer .left-out").inner_text()
    hidden = page.locator("section.on-screen").all()
    assert len(hidden) >= 3
    for section in hidden:
        assert not section.is_visible()
        title = section.locator("h3").first.text_content() or ""
        assert title in left_out
    assert "tables/" in str(page.locator("details.many + .left-out").first.text_content())
    page.locator("#everything").evaluate("one => one.checked = true")
    assert page.locator("#tables details td").first.is_visible()
    assert not page.locator("footer .left-out").is_visible()
    page.locator("#everything").evaluate("one => one.checked = false")
    page.emulate_media(media="screen")
    assert not page.locator("footer .left-out").is_visible()


def test_the_dark_scheme_is_dark_and_its_text_light(
    browser: Browser, reports: dict[str, Path]
) -> None:
    page = opened(browser, reports["study"], PHONE)
    page.emulate_media(color_scheme="dark")
    label = page.locator("#effects svg text").first
    assert "rgb(232, 232, 230)" in label.evaluate("one => getComputedStyle(one).fill")
    style = "getComputedStyle(document.body)"
    ground, ink = (
        sum(map(int, re.findall(r"\d+", page.evaluate(f"{style}.{name}"))[:3])) / 765
        for name in ("backgroundColor", "color")
    )
    assert ground < 0.15
    assert ink > 0.8
    page.close()


def test_a_point_names_its_epoch_and_opens_its_traces(on_a_desk: Page) -> None:
    page = on_a_desk
    wrong: list[str] = []
    page.on("pageerror", lambda error: wrong.append(str(error)))
    page.on("console", lambda said: wrong.append(said.text))
    ready_ms = page.evaluate("performance.getEntriesByType('navigation')[0].loadEventEnd")
    assert 0 < ready_ms < READY_MS
    point = (
        page.locator("#distributions figure", has_text="Stiffness K").locator("[data-epoch]").first
    )
    point.scroll_into_view_if_needed()
    point.hover()
    tip = page.locator("#tip")
    assert re.match(r"epoch \w+ of M1-day-\d\d – click for its traces", tip.inner_text())
    point.click()
    dialog = page.locator("#epoch")
    assert "K " in dialog.locator(".remark").inner_text()
    titles = dialog.locator(".u-title").all_inner_texts()
    assert titles == ["Torque (N·m)", "Measured less model (N·m)", "Angle (deg)"]
    plot = dialog.locator("canvas").first
    drawn = plot.evaluate(
        "one => one.getContext('2d').getImageData(0, 0, one.width, one.height).data.some(x => x)"
    )
    assert drawn
    first = dialog.locator(".title").inner_text()
    dialog.get_by_text("Next epoch").click()
    assert dialog.locator(".title").inner_text() != first
    page.screenshot(path=SCREENS / "traces.png")
    page.keyboard.press("Escape")
    assert not dialog.is_visible()
    assert wrong == []


def test_without_scripts_the_figures_and_their_words_remain(
    browser: Browser, reports: dict[str, Path]
) -> None:
    page = browser.new_page(java_script_enabled=False)
    page.goto(reports["study"].as_uri())
    figure = page.locator("#distributions figure", has_text="Stiffness K")
    assert figure.locator("svg").is_visible()
    assert "epoch" in str(figure.locator("use title").first.text_content())
    assert not page.locator("#epoch").is_visible()
    page.close()
