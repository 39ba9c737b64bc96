"""A drawing as part of the page: names of its own, colours of the page, points that name epochs."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence

from markupsafe import Markup, escape

COLOURS = {
    "#000000": "ink",
    "#1c1c1c": "ink",
    "#555555": "soft",
    "#e4e4e4": "line",
    "#ffffff": "paper",
    "#d55e00": "off",
    "#0072b2": "dbs",
    "#8a3b00": "warn",
}
"""Colours that differ in the dark, and the variable of the page's style for each."""

_TAG = re.compile(r"<[^>]*>")
_LEFT_OUT = re.compile(
    r"<metadata>.*?</metadata>|<style[^>]*>.*?</style>|<!--.*?-->|(?<=>)\s+(?=<)", re.DOTALL
)
_NOT_OF_A_PAGE = re.compile(r' xmlns(?::xlink)?="[^"]*"| version="1.1"')
_SPACE = re.compile(r"\s+")
_DIGITS = re.compile(r"(\.\d\d)\d+")
_POINTS = re.compile(r"<g([^>]*)>((?:<use [^>]*/>){2,})</g>")
_STYLE = re.compile(r' style="[^"]*"')
_USED = re.compile(r'(?:href="|url\()#([^")]+)')
_NAMED = re.compile(r' id="([^"]*)"')
_POINT = re.compile(r"<use ([^>]*?)/>")
_COLOUR = re.compile(r"#[0-9a-fA-F]{6}\b")


def inline_svg(
    svg: str,
    name: str,
    alt: str,
    marks: Mapping[str, Sequence[tuple[str, str]]],
    places: Mapping[tuple[str, str], int],
    called: Callable[[str, str], str],
) -> Markup:
    """Return an SVG document of `style.svg_text` as an element of the page.

    Parameters
    ----------
    svg : str
    name : str
        Of the figure; the names inside begin with it, for a page has many figures.
    alt : str
        What it shows, for those who cannot see it.
    marks : mapping of str to sequence of (str, str)
        By the group of a line of points: what each of its points stands for, in their order.
    places : mapping of (str, str) to int
        The place of the traces of an epoch, by source and label.
    called : callable
        Takes source and label of an epoch; returns what it is called on the page.
    """
    text = _TAG.sub(_shorter, _LEFT_OUT.sub("", svg[svg.index("<svg") :]))
    text = _POINTS.sub(_styled_once, text)
    for group, own in marks.items():
        text = _marked(text, group, own, places, called)
    used = set(_USED.findall(text))
    prefix = re.sub(r"[^A-Za-z0-9_-]", "_", name)

    def of_the_page(found: re.Match[str]) -> str:
        tag = _NAMED.sub(lambda m: f' id="{prefix}-{m[1]}"' if m[1] in used else "", found[0])
        tag = re.sub(r'(href="|url\()#', rf"\g<1>#{prefix}-", tag)
        return _COLOUR.sub(_variable, tag)

    text = _TAG.sub(of_the_page, text)
    return Markup(text.replace("<svg", f'<svg role="img" aria-label="{escape(alt)}"', 1))


def _shorter(tag: re.Match[str]) -> str:
    """Return a tag with hundredths of a point; what is between tags stays as it is."""
    return _DIGITS.sub(r"\1", _SPACE.sub(" ", _NOT_OF_A_PAGE.sub("", tag[0])))


def _variable(colour: re.Match[str]) -> str:
    name = COLOURS.get(colour[0].lower())
    return f"var(--{name},{colour[0]})" if name else colour[0]


def _styled_once(points: re.Match[str]) -> str:
    """Return a group of points of one style with that style at the group."""
    attributes, inside = points.groups()
    styles = set(_STYLE.findall(inside))
    if len(styles) != 1 or inside.count(" style=") != inside.count("<use"):
        return points[0]
    return f"<g{attributes}{styles.pop()}>{_STYLE.sub('', inside)}</g>"


def _marked(
    text: str,
    group: str,
    own: Sequence[tuple[str, str]],
    places: Mapping[tuple[str, str], int],
    called: Callable[[str, str], str],
) -> str:
    """Return the SVG with the epoch of each point of a group, and the place of its traces."""
    start = text.find(f'<g id="{group}">')
    if start < 0:
        return text
    stop = text.index("</g>", start)
    points = _POINT.findall(text, start, stop)
    if len(points) != len(own):  # one outside the axes is not drawn: which one is not known
        return text
    drawn = []
    for attributes, mark in zip(points, own, strict=True):
        place = places.get(mark)
        traces = "" if place is None else f' data-epoch="{place}"'
        drawn.append(f"<use {attributes}{traces}><title>{escape(called(*mark))}</title></use>")
    given = iter(drawn)
    return text[:start] + _POINT.sub(lambda _: next(given), text[start:stop]) + text[stop:]
