"""Whether the sensors measured, and the arm had room.

Where a sensor hung or was at the end of its range (`bad_stretches`), that stretch is left out and
the check notes it; where too little would be left, the check speaks of the whole epoch. A joint at
the position limit, or a command that the guard changed, is not the perturbation as designed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from rigidimeter.analysis.estimation.bad_stretches import longest_repetition, share_at_extremes
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    HARMFUL,
    Case,
    Check,
    Harmless,
    Look,
    at_most,
)
from rigidimeter.analysis.estimation.stretches import fitted_channels, left_out_s
from rigidimeter.core.findings import Fact
from rigidimeter.core.records import LOST_SAMPLES, Channel, Epoch, LeftOut, Ticks
from rigidimeter.core.settings import DiagnosticsSettings
from rigidimeter.core.units import deg_from_rad

MOST_SHOWN = 3


def saturation(epoch: Epoch, settings: DiagnosticsSettings) -> Look:
    """Return the largest share of samples in which a channel repeats its extreme value."""
    most, found = settings.max_saturated_percent, _left_out(epoch, "saturation")
    if found:
        value = 100.0 * _seconds(found) / _length_s(epoch)
        return Look(value, most, True, {"channel": _channels(found), **rest_of(epoch, found)})
    shares = {c.name: 100.0 * share_at_extremes(epoch, c, settings) for c in fitted_channels(epoch)}
    worst = max(shares, key=lambda name: shares[name])
    return at_most(shares[worst], most, channel=worst)


def frozen(epoch: Epoch, settings: DiagnosticsSettings) -> Look:
    """Return the longest time for which a channel repeats one value."""
    most, found = settings.max_frozen_s, _left_out(epoch, "frozen")
    if found:
        value = max(stretch.stop_s - stretch.start_s for stretch in found)
        return Look(value, most, True, {"channel": _channels(found), **rest_of(epoch, found)})
    longest = {c.name: longest_repetition(epoch, c, settings) for c in fitted_channels(epoch)}
    worst = max(longest, key=lambda name: longest[name][0])
    value, start_s = longest[worst]
    return at_most(value, most, channel=worst, start_s=start_s)


def left_out(epoch: Epoch) -> Look:
    """Return for how long the user left parts of the epoch out, in s."""
    found = _left_out(epoch, "")
    reasons = "; ".join(dict.fromkeys(stretch.reason for stretch in found if stretch.reason))
    facts = {"reason": reasons or "no reason was given", **rest_of(epoch, found)}
    return Look(_seconds(found), 0.0, bool(found), facts)


def lost_samples(epoch: Epoch, settings: DiagnosticsSettings) -> Look:
    """Return in which share of the epoch's time its samples are lost, in %."""
    found, most = _left_out(epoch, LOST_SAMPLES), settings.max_left_out_percent
    if not found:
        return Look(0.0, most, False)
    torque_s, lost_s = epoch.channels["torque_nm"].time_s, _seconds(found)
    start_s = min(float(torque_s[0]), *(stretch.start_s for stretch in found))
    stop_s = max(float(torque_s[-1]), *(stretch.stop_s for stretch in found))
    value = 100.0 * lost_s / (stop_s - start_s)
    facts = {"lost_s": lost_s, "reason": found[0].reason, **rest_of(epoch, found)}
    return Look(value, most, True, facts)


def is_left_out(check: str) -> Callable[[Case, Look], Harmless]:
    """Return what says whether the stretches that a check found are left out."""

    def left_out(case: Case, look: Look) -> Harmless:
        del look
        return ("left_out", {}) if _left_out(case.epoch, check) else HARMFUL

    return left_out


def _enough_is_left(case: Case, look: Look) -> Harmless:
    return is_left_out(LOST_SAMPLES)(case, look) if look.value <= look.limit else HARMFUL


def _left_out(epoch: Epoch, check: str) -> list[LeftOut]:
    return [stretch for stretch in epoch.left_out if stretch.check == check]


def _channels(stretches: Sequence[LeftOut]) -> str:
    """Return the channels that repeat a value; the reason of a stretch begins with its channel."""
    return " and ".join(dict.fromkeys(stretch.reason.split()[0] for stretch in stretches))


def _seconds(stretches: Sequence[LeftOut]) -> float:
    return sum(stretch.stop_s - stretch.start_s for stretch in stretches)


def _spans(stretches: Sequence[LeftOut]) -> str:
    spans = [f"from {s.start_s:.4g} to {s.stop_s:.4g} s" for s in stretches[:MOST_SHOWN]]
    more = len(stretches) - MOST_SHOWN
    return " and ".join(spans) + (f" and {more} more" if more > 0 else "")


def _length_s(epoch: Epoch) -> float:
    torque = epoch.channels["torque_nm"]
    return float(torque.time_s[-1] - torque.time_s[0])


def rest_of(epoch: Epoch, stretches: Sequence[LeftOut]) -> dict[str, Fact]:
    """Return which parts are left out, and how much of the epoch is used."""
    length_s = _length_s(epoch)
    used_s = length_s - left_out_s(epoch)
    return {"spans": _spans(stretches), "used_s": used_s, "length_s": length_s}


def missed_ticks(ticks: Ticks, settings: DiagnosticsSettings) -> Look:
    """Return in what share of the ticks that were due the loop did not run, in %."""
    return at_most(
        ticks.missed_percent,
        settings.max_missed_ticks_percent,
        missed=ticks.missed,
        ticks=ticks.ran + ticks.missed,
        late=ticks.late,
    )


def _followed(case: Case, look: Look) -> Harmless:
    """Return that the estimate follows a command that was held, where it knows the drive."""
    del look
    by_samples = case.method is None or case.method.as_recorded
    if by_samples or case.prepared is None or case.prepared.source.drive is None:
        return HARMFUL
    return "followed", {}


def guard_limited(ticks: Ticks, settings: DiagnosticsSettings) -> Look:
    """Return in what share of the ticks the guard changed the command, in %."""
    return at_most(100.0 * ticks.limited / ticks.ran, settings.max_limited_percent)


def position_limit(angle: Channel, limit_rad: float, settings: DiagnosticsSettings) -> Look:
    """Return how near the joint came to the position limit, in % of it."""
    value = 100.0 * float(np.max(np.abs(angle.values))) / limit_rad
    return at_most(value, settings.max_position_percent, limit_deg=deg_from_rad(limit_rad))


def _position_limit(case: Case) -> Look | None:
    if case.position_limit_rad is None:
        return None
    return position_limit(case.epoch.channels["angle_rad"], case.position_limit_rad, case.settings)


CHANNEL_CHECKS = (
    Check(
        "saturation",
        (),
        lambda c: saturation(c.epoch, c.settings),
        of_fit=False,
        harmless=is_left_out("saturation"),
    ),
    Check(
        "frozen",
        (),
        lambda c: frozen(c.epoch, c.settings),
        of_fit=False,
        harmless=is_left_out("frozen"),
    ),
    Check("left_out", (), lambda c: left_out(c.epoch), of_fit=False),
    Check(
        LOST_SAMPLES,
        (),
        lambda c: lost_samples(c.epoch, c.settings),
        of_fit=False,
        harmless=_enough_is_left,
    ),
    Check(
        "missed_ticks",
        ("velocity_command_rad_s",),
        lambda c: None if c.epoch.ticks is None else missed_ticks(c.epoch.ticks, c.settings),
        of_fit=False,
        harmless=_followed,
    ),
    Check(
        "guard_limited",
        (),
        lambda c: None if c.epoch.ticks is None else guard_limited(c.epoch.ticks, c.settings),
        of_fit=False,
    ),
    Check("position_limit", ("angle_rad",), _position_limit, of_fit=False),
)
