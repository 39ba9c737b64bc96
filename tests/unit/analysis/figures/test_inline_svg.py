"""A drawing inside the page: its texts, its points and their epochs."""

import re

from markupsafe import escape

from rigidimeter.analysis.figures import draw_distribution, inline_svg, svg_text
from rigidimeter.analysis.figures import drawn as figure_of

NAME = '<b> 0.12345 #0072b2 id="x"'


def drawn(
    values: list[float], marks: list[tuple[str, str]], places: dict[tuple[str, str], int]
) -> str:
    figure = figure_of((3.0, 3.0), draw_distribution, "y (1)", {NAME: values}, {NAME: "#0072B2"})
    document = svg_text(figure)
    return inline_svg(
        document, "a/b", 'A "drawing"', {"epochs-0": marks}, places, "epoch {1} of {0}".format
    )


def test_points_carry_the_names_and_traces_of_their_epochs_in_order() -> None:
    marks = [("s", f"{k} <&>") for k in range(3)]
    text = drawn([1.0, 3.0, 2.0], marks, {("s", "2 <&>"): 7})
    assert re.findall(r"<title>(.*?)</title>", text) == [
        f"epoch {escape(label)} of s" for _, label in marks
    ]
    uses = re.findall(r"<use ([^>]*)><title>", text)
    assert ["data-epoch" in use for use in uses] == [False, False, True]
    assert 'data-epoch="7"' in uses[2]
    # Upwards on the page is downwards in SVG: the order of the points is that of the values.
    heights = [float(re.search(r'y="([\d.]+)"', use)[1]) for use in uses]
    assert heights[0] > heights[2] > heights[1]


def test_points_that_cannot_be_told_apart_get_no_words() -> None:
    assert "<title>" not in drawn([1.0, 2.0], [("s", "0")], {})


def test_text_stays_as_it_is_and_names_and_colours_are_those_of_the_page() -> None:
    text = drawn([1.0, 2.0], [], {})
    words = re.findall(r">([^<>]+)</text>", text)
    assert any("0.12345" in word or "…" in word for word in words)
    assert "var(--dbs,#0072b2)" in text
    assert "xmlns" not in text
    assert text.startswith('<svg role="img" aria-label="A &#34;drawing&#34;"')
    names = re.findall(r'<[^>]* id="([^"]*)"', text)
    assert names
    assert all(name.startswith("a_b-") for name in names)
    assert set(re.findall(r'(?:href="|url\()#([^")]+)', text)) == set(names)
