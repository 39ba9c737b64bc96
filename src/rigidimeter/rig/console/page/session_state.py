"""Facts and samples in the form in which the page gets them: text to show, numbers to draw."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from rigidimeter.core.units import deg_from_rad
from rigidimeter.rig.acquisition import State
from rigidimeter.rig.console import (
    AT_ONCE,
    TRACES,
    ConditionCount,
    Facts,
    Level,
    LimitDistance,
    Progress,
    Traces,
)
from rigidimeter.rig.console.page.button_words import in_buttons

LEVELS = {Level.UNKNOWN: "off", Level.GOOD: "ok", Level.WATCH: "warn", Level.BAD: "bad"}
"""What the page calls the levels of a lamp; each has a colour there."""

ORDERS = {
    State.IDLE: ("abort",),
    State.RUNNING: ("pause", "pause_now", "resume", "stop", "abort"),
    State.PAUSED: ("resume", "stop", "abort"),
    State.STOPPING: (),
    State.FAULTED: (),
}
"""Which orders mean something in which state."""

_DEGREES = ("angle_rad", "velocity_command_rad_s")


def session_state(facts: Facts, progress: Progress) -> dict[str, Any]:
    """Return what the page shows of a session that runs; `progress` tells what can be rated."""
    epoch = facts.epoch or facts.next_epoch
    words = {"epoch": "Epoch: time left", "rest": "Rest: time left"}
    again = ", again" if epoch is not None and epoch.again else ""
    place = f"{epoch.place} of {epoch.of}{again}" if epoch is not None else "all done"
    rated = progress.ended[-1] if progress.ended and not progress.running else None
    drawn = progress.current or (progress.to_run[0] if progress.to_run else None)
    return {
        "state": facts.state_words,
        "condition": epoch.condition if epoch is not None else "–",
        "epoch": place,
        "epoch_of": "Epoch" if facts.epoch is not None or epoch is None else "Next epoch",
        "countdown": duration(facts.countdown_s),
        "countdown_of": words.get(facts.countdown_words, facts.countdown_words or "Time left"),
        "counts": [
            *(_count(count) for count in facts.counts),
            f"session: {duration(facts.session_left_s)} left",
        ],
        "live": [value.text for value in facts.live],
        "live_of": facts.live_words,
        "task": drawn.task if drawn is not None else "",
        "modelled": is_known(facts),
        "limits": [_limit(one) for one in facts.distances if math.isfinite(one.part)],
        "lamps": [
            {
                "level": LEVELS[lamp.level],
                "sign": lamp.level.sign,
                "text": f"{lamp.name}: {in_buttons(lamp.words)}",
            }
            for lamp in facts.lamps
        ],
        "alert": in_buttons(facts.stop_words),
        "orders": [] if progress.outcome else list(ORDERS[facts.state]),
        "rate": {"number": rated.number, "place": rated.place} if rated is not None else None,
    }


def duration(seconds: float) -> str:
    """Return a time that is left, rounded up.

    Examples
    --------
    >>> duration(12.2), duration(75.0)
    ('13 s', '1:15 min')
    """
    if not math.isfinite(seconds):
        return "–"
    whole = math.ceil(max(seconds, 0.0))
    return f"{whole} s" if whole < 60 else f"{whole // 60}:{whole % 60:02d} min"


def is_known(facts: Facts) -> bool:
    """Whether J, B and K are shown, all of them, and so what they say of the torque."""
    return bool(facts.live) and all(value.settled for value in facts.live)


def points(traces: Traces, *, modelled: bool) -> bytes:
    """Return samples as little-endian float64, 13 numbers for each piece of time.

    The time in s; the least values of the traces, then the largest; then those of the piece's
    first sample: angle, torque, and the torque in the band of the live estimate, measured and
    modelled. Angles are in degrees. The modelled torque is NaN unless `modelled`.
    """
    columns = [traces.time_s]
    for values, names in (
        (traces.low, TRACES),
        (traces.high, TRACES),
        (traces.first, AT_ONCE),
    ):
        columns += [
            (deg_from_rad(1.0) if name in _DEGREES else 1.0) * values[name] for name in names
        ]
    if not modelled:
        columns[-1] = np.full(traces.time_s.size, np.nan)
    return np.column_stack(columns).astype("<f8").tobytes()


def _count(count: ConditionCount) -> str:
    bad = f", {count.bad} not good" if count.bad else ""
    return f"{count.condition}: {count.good} done{bad}, {count.left} left"


def _limit(one: LimitDistance) -> dict[str, Any]:
    return {
        "name": one.name,
        "sign": (Level.WATCH if one.near else Level.GOOD).sign,
        "text": one.text,
        "part": round(one.part, 3),
        "near": one.near,
    }
