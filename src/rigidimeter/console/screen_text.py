"""The full screen as lines of text: what to show is in `Facts`, here is only how.

The first lines say where the session is and why it stands, the last ones what can be done; what is
between them is left out from its end where the screen is small. Colour repeats what a sign and
words say.
"""

from __future__ import annotations

import io
import math
from collections.abc import Sequence

from rich.console import Console
from rich.text import Text

from rigidimeter.acquisition.run_states import State
from rigidimeter.console.facts import Facts
from rigidimeter.console.lamps import Level

COLOURS = {Level.UNKNOWN: "dim", Level.GOOD: "", Level.WATCH: "bold yellow", Level.BAD: "bold red"}

KEYS_LINE = "p pause next  n pause now  r resume  s end after epoch  a abort  : set, note"
EMERGENCY_LINE = "SPACE or e: EMERGENCY STOP     h: halt, power off     other keys: pause now"

MOST_LINES = 4
"""Of one trouble."""

_BAR = 20


def screen_lines(
    facts: Facts,
    title: str,
    messages: Sequence[str],
    prompt: str | None,
    width: int,
    height: int,
) -> list[Text]:
    """Return at most `height` lines of less than `width` cells.

    Parameters
    ----------
    facts : Facts
    title : str
        What session this is.
    messages : sequence of str
        What was said to the operator, the newest last.
    prompt : str or None
        What is being typed; None where keys are orders.
    width, height : int
        Of the screen, in cells.
    """
    cells = max(width - 1, 1)  # nothing in the last column: some terminals go on to the next line
    head = _head(facts, title)
    for trouble in _troubles(facts):
        head += _wrapped(Text(trouble, "bold red"), cells, MOST_LINES)
    body = [*_live(facts), *_limits(facts), *_lamps(facts)]
    foot = [
        *(Text(clean(message)) for message in messages[-2:]),
        Text(KEYS_LINE if prompt is None else f": {clean(prompt)}_   Enter does it, Esc leaves"),
        Text(EMERGENCY_LINE if prompt is None else "Ctrl-C: abort now", style="bold reverse"),
    ]
    room = max(height - len(head) - len(foot), 0)
    lines = [*head, *body[:room], *foot][-height:]
    for line in lines:
        line.truncate(cells, overflow="ellipsis")
    return lines


def painted(lines: Sequence[Text], width: int) -> bytes:
    """Return what a terminal takes to show these lines from its upper left corner on."""
    out = io.StringIO()
    console = Console(
        file=out,
        force_terminal=True,
        color_system="standard",
        width=width,
        legacy_windows=False,
        highlight=False,
        markup=False,
        emoji=False,
    )
    for k, line in enumerate(lines):
        out.write("\x1b[K" if k == 0 else "\x1b[K\r\n\x1b[K")
        console.print(line, end="", no_wrap=True, soft_wrap=True)
    return f"\x1b[H{out.getvalue()}\x1b[J".encode()


def clean(text: str) -> str:
    """Return a text without characters that would steer the terminal."""
    return "".join(c if c.isprintable() else "?" for c in text)


def time_left(seconds: float) -> str:
    """Return a time as minutes and seconds; empty where it is not known."""
    if not math.isfinite(seconds):
        return ""
    whole = math.ceil(seconds)
    return f"{whole} s" if whole < 60 else f"{whole // 60} min {whole % 60:02d} s"


def _head(facts: Facts, title: str) -> list[Text]:
    epoch = facts.epoch or facts.next_epoch
    what = clean(epoch.text) if epoch is not None else "no epoch is left"
    if facts.epoch is None and epoch is not None:
        what = f"next: {what}"
    colour = "bold" if facts.state is State.RUNNING else "bold yellow"
    left = f"   session: {time_left(facts.session_left_s)} left"
    counted = f"   {facts.countdown_words}: {time_left(facts.countdown_s)} left"
    conditions = "   ".join(
        f"{clean(count.condition)}: {count.good} good, {count.bad} bad, {count.left} left"
        for count in facts.counts
    )
    return [
        Text(f"rigidimeter  {clean(title)}  {facts.time_s:.1f} s", style="dim"),
        Text(what, style="bold"),
        Text.assemble(
            (facts.state_words.upper(), colour), counted if facts.countdown_words else "", left
        ),
        Text(conditions),
    ]


def _troubles(facts: Facts) -> list[str]:
    """Return what needs all its words: why it stands, and a disk that takes nothing."""
    disk = [lamp.words for lamp in facts.lamps if lamp.name == "disk" and lamp.level is Level.BAD]
    said = [facts.stop_words, *disk]
    return [clean(f"{Level.BAD.sign} {words}") for words in said if words]


def _wrapped(text: Text, cells: int, most: int) -> list[Text]:
    """Return a text in as many lines as it takes, at most so many."""
    return list(text.wrap(Console(width=cells, file=io.StringIO()), cells))[:most]


def _live(facts: Facts) -> list[Text]:
    of = f"live, {facts.live_words}" if facts.live_words else "live"
    return [
        Text.assemble((f"{of if k == 0 else '':16}", "dim"), value.text)
        for k, value in enumerate(facts.live)
    ]


def _limits(facts: Facts) -> list[Text]:
    lines = []
    for distance in facts.distances:
        known = math.isfinite(distance.part)
        part = min(max(distance.part, 0.0), 1.0) if known else 0.0
        bar = "█" * round(_BAR * part) + "░" * (_BAR - round(_BAR * part))
        sign = (Level.WATCH if distance.near else Level.GOOD).sign if known else Level.UNKNOWN.sign
        colour = COLOURS[Level.WATCH] if known and distance.near else ""
        percent = f"{100 * distance.part:4.0f} %" if known else "     -"
        line = f"{sign} {distance.name:8}{bar}{percent}  {distance.text}"
        lines.append(Text(f"{line:55}  {distance.left_text}".rstrip(), style=colour))
    return lines


def _lamps(facts: Facts) -> list[Text]:
    return [
        Text(f"{lamp.level.sign} {lamp.name:9}{clean(lamp.words)}", style=COLOURS[lamp.level])
        for lamp in facts.lamps
    ]
