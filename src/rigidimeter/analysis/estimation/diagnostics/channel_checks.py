"""Whether the sensors measured, and the arm had room.

Where a sensor hung or was at the end of its range (`bad_stretches`), that stretch is left out and
the check notes it; where too little would be left, the check speaks of the whole epoch. A joint at
the position limit, or a command that the guard changed, is not the perturbation as designed.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from rigidimeter.analysis.estimation.bad_stretches import (
    FITTED,
    longest_repetition,
    share_at_extremes,
)
from rigidimeter.analysis.estimation.between_epochs import in_full
from rigidimeter.analysis.estimation.diagnostics.check_record import (
    Case,
    Check,
    Look,
    at_most,
)
from rigidimeter.analysis.estimation.stretches import left_out_s
from rigidimeter.core.records import LOST_SAMPLES, Channel, Epoch, LeftOut, Ticks
from rigidimeter.core.settings import DiagnosticsSettings

MOST_SHOWN = 3


def saturation(epoch: Epoch, settings: DiagnosticsSettings) -> Look:
    """Return the largest share of samples in which a channel repeats its extreme value."""
    most = settings.max_saturated_percent
    left_out = _left_out(epoch, "saturation")
    if left_out:
        value = 100.0 * _seconds(left_out) / _length_s(epoch)
        share = in_full(value, limit=most)
        fact = f"{_channels(left_out)} in {share} % of the time (at most {most:g} %)"
        return Look(value, most, True, fact)
    shares = {c.name: 100.0 * share_at_extremes(epoch, c, settings) for c in _fitted(epoch)}
    worst = max(shares, key=lambda name: shares[name])
    value = shares[worst]
    return at_most(
        value,
        most,
        f"{worst} repeats its extreme values in {in_full(value, limit=most)} % of samples (at most "
        f"{most:g} %)",
    )


def frozen(epoch: Epoch, settings: DiagnosticsSettings) -> Look:
    """Return the longest time for which a channel repeats one value."""
    most = settings.max_frozen_s
    left_out = _left_out(epoch, "frozen")
    if left_out:
        longest = max(left_out, key=lambda stretch: stretch.stop_s - stretch.start_s)
        value, start_s, what = longest.stop_s - longest.start_s, longest.start_s, longest.reason
    else:
        found = {c.name: longest_repetition(epoch, c, settings) for c in _fitted(epoch)}
        worst = max(found, key=lambda name: found[name][0])
        (value, start_s), what = found[worst], f"{worst} repeats one value"
    when = f", from {start_s:.4g} s" if value > 0 else ""
    fact = f"{what} for {in_full(value, limit=most)} s (at most {most:g} s){when}"
    return at_most(value, most, fact)


def left_out(epoch: Epoch) -> Look:
    """Return for how long the user left parts of the epoch out, in s."""
    found = _left_out(epoch, "")
    if not found:
        return Look(0.0, 0.0, False, "nothing is left out by hand")
    value = _seconds(found)
    reasons = "; ".join(dict.fromkeys(stretch.reason for stretch in found if stretch.reason))
    fact = f"{value:.3g} s are left out by hand, {_spans(found)}"
    return Look(value, 0.0, True, fact, f"{reasons or 'no reason was given'}; {_rest(epoch)}")


def lost_samples(epoch: Epoch, settings: DiagnosticsSettings) -> Look:
    """Return in which share of the epoch's time its samples are lost, in %."""
    found, most = _left_out(epoch, LOST_SAMPLES), settings.max_left_out_percent
    if not found:
        return Look(0.0, most, False, "no samples are lost")
    lost_s = _seconds(found)
    torque_s = epoch.channels["torque_nm"].time_s
    start_s = min(float(torque_s[0]), *(stretch.start_s for stretch in found))
    stop_s = max(float(torque_s[-1]), *(stretch.stop_s for stretch in found))
    value = 100.0 * lost_s / (stop_s - start_s)
    reasons = "; ".join(stretch.reason for stretch in found[:MOST_SHOWN])
    share = f"{in_full(value, limit=most)} % of the epoch (at most {most:g} %)"
    return Look(value, most, True, f"samples of {lost_s:.3g} s are lost, {share}: {reasons}")


def _said_lost(case: Case, look: Look) -> str:
    """Return that what is lost is left out, where enough is left."""
    return said_left_out(LOST_SAMPLES)(case, look) if look.value <= look.threshold else ""


def said_left_out(check: str) -> Callable[[Case, Look], str]:
    """Return what says that the stretches which a check found are left out; else nothing."""

    def said(case: Case, look: Look) -> str:
        del look
        found = _left_out(case.epoch, check)
        return f"left out, {_spans(found)}; {_rest(case.epoch)}" if found else ""

    return said


def _left_out(epoch: Epoch, check: str) -> list[LeftOut]:
    return [stretch for stretch in epoch.left_out if stretch.check == check]


def _channels(stretches: Sequence[LeftOut]) -> str:
    return " and ".join(dict.fromkeys(stretch.reason for stretch in stretches))


def _seconds(stretches: Sequence[LeftOut]) -> float:
    return sum(stretch.stop_s - stretch.start_s for stretch in stretches)


def _spans(stretches: Sequence[LeftOut]) -> str:
    spans = [f"from {s.start_s:.4g} to {s.stop_s:.4g} s" for s in stretches[:MOST_SHOWN]]
    more = len(stretches) - MOST_SHOWN
    return " and ".join(spans) + (f" and {more} more" if more > 0 else "")


def _length_s(epoch: Epoch) -> float:
    torque = epoch.channels["torque_nm"]
    return float(torque.time_s[-1] - torque.time_s[0])


def _rest(epoch: Epoch) -> str:
    """Say what of an epoch is used."""
    whole_s = _length_s(epoch)
    return f"{whole_s - left_out_s(epoch):.3g} of {whole_s:.3g} s are used"


def missed_ticks(ticks: Ticks, settings: DiagnosticsSettings) -> Look:
    """Return in what share of the ticks that were due the loop did not run, in %."""
    most = settings.max_missed_ticks_percent
    fact = (
        f"{ticks.missed} of {ticks.ran + ticks.missed} ticks never ran "
        f"({in_full(ticks.missed_percent)} %, at most {most:g} %), and {ticks.late} were late"
    )
    return at_most(ticks.missed_percent, most, fact)


def _followed(case: Case, look: Look) -> str:
    """Return that the estimate follows a command that was held, where it knows the drive."""
    del look
    by_samples = case.method is None or case.method.as_recorded
    if by_samples or case.prepared is None or case.prepared.source.drive is None:
        return ""
    return (
        "the drive held its command at them, and the estimate allows for that: nothing moves J, B "
        "and K beyond their intervals"
    )


def guard_limited(ticks: Ticks, settings: DiagnosticsSettings) -> Look:
    """Return in what share of the ticks the guard changed the command, in %."""
    value = 100.0 * ticks.limited / ticks.ran
    most = settings.max_limited_percent
    return at_most(
        value,
        most,
        f"the guard changed {in_full(value, limit=most)} % of the commands (at most {most:g} %)",
    )


def position_limit(angle: Channel, limit_rad: float, settings: DiagnosticsSettings) -> Look:
    """Return how near the joint came to the position limit, in % of it."""
    value = 100.0 * float(np.max(np.abs(angle.values))) / limit_rad
    most = settings.max_position_percent
    return at_most(
        value,
        most,
        (
            f"the joint came to {in_full(value, '.0f', limit=most)} % of the position limit of "
            f"{math.degrees(limit_rad):.3g} deg (at most {most:g} %)"
        ),
    )


def _fitted(epoch: Epoch) -> list[Channel]:
    return [epoch.channels[name] for name in FITTED if name in epoch.channels]


def _position_limit(case: Case) -> Look | None:
    if case.position_limit_rad is None:
        return None
    return position_limit(case.epoch.channels["angle_rad"], case.position_limit_rad, case.settings)


CHANNEL_CHECKS = (
    Check(
        "saturation",
        (),
        lambda c: saturation(c.epoch, c.settings),
        "the sensor or its amplifier was at the end of its range",
        "choose a larger range or a smaller perturbation, and repeat",
        of_fit=False,
        harmless=said_left_out("saturation"),
    ),
    Check(
        "frozen",
        (),
        lambda c: frozen(c.epoch, c.settings),
        "the sensor hung, or the joint was held",
        "check the sensor's cable and its rate",
        of_fit=False,
        harmless=said_left_out("frozen"),
    ),
    Check(
        "left_out",
        (),
        lambda c: left_out(c.epoch),
        "",
        "see whether the estimate changes with them",
        of_fit=False,
    ),
    Check(
        LOST_SAMPLES,
        (),
        lambda c: lost_samples(c.epoch, c.settings),
        "what is left is another experiment than was planned",
        "read a copy of the recording that is whole; test the disk that it was on",
        of_fit=False,
        harmless=_said_lost,
    ),
    Check(
        "missed_ticks",
        ("velocity_command_rad_s",),
        lambda c: None if c.epoch.ticks is None else missed_ticks(c.epoch.ticks, c.settings),
        "the drive held its command at them, and how the joint then moved between the samples is "
        "not known",
        "run it on a processor of its own with `--cpu N`, close other programs, or lower "
        "rig.tick_rate_hz",
        of_fit=False,
        harmless=_followed,
    ),
    Check(
        "guard_limited",
        (),
        lambda c: None if c.epoch.ticks is None else guard_limited(c.epoch.ticks, c.settings),
        "the arm did not follow the perturbation as designed",
        "use a smaller perturbation or wider limits in [guard]",
        of_fit=False,
    ),
    Check(
        "position_limit",
        ("angle_rad",),
        _position_limit,
        "it was held back there, which the fit takes for stiffness",
        "use a smaller perturbation, or begin nearer to the middle of the range",
        of_fit=False,
    ),
)
