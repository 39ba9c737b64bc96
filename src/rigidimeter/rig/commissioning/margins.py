"""Whether the protocol's controller is stable on this rig, with the delays that were measured."""

from __future__ import annotations

import math

from rigidimeter.core.settings import Settings
from rigidimeter.model import Margins, loop_stability, near_instability
from rigidimeter.rig.commissioning.checks import Check, impossible, number, yes


def on_measured_rig(settings: Settings, bandwidth_hz: float, delay_s: float) -> Settings:
    """Return the settings with the rig as it was measured.

    The delay around the loop is put on the torque, which is then new at every tick: its age
    is in the delay already.
    """
    rig = settings.rig
    torque = rig.torque.model_copy(
        update={
            "rate_hz": rig.tick_rate_hz,
            "latency_s": delay_s,
            "stamp_latency_s": delay_s,
            "jitter_s": 0.0,
        }
    )
    measured = rig.model_copy(update={"drive_bandwidth_hz": bandwidth_hz, "torque": torque})
    return settings.model_copy(update={"rig": measured})


def margin_checks(
    settings: Settings, bandwidth_hz: float, delay_s: float | None
) -> tuple[list[Check], dict[str, float]]:
    """Check the margins with every condition's arm, and stability with those around it."""
    remedy = "raise the controller's inertia or damping, or shorten the delays"
    if delay_s is None or not (math.isfinite(delay_s) and math.isfinite(bandwidth_hz)):
        limit = f"at least {settings.margins.gain_margin_db:g} dB"
        return [impossible("stability", limit, "the delay of the loop could not be measured")], {}
    measured = on_measured_rig(settings, bandwidth_hz, delay_s)
    stability = loop_stability(measured)
    wanted = settings.margins
    limit = f"at least {wanted.gain_margin_db:g} dB and {wanted.phase_margin_deg:g} deg"
    checks, numbers = [], {}
    for name, margins in stability.conditions.items():
        why = near_instability(f"the loop with subject {name}", margins, measured)
        words = _words(margins)
        checks.append(yes(f"stability with {name}", not why, words, limit, remedy))
        numbers[f"gain_margin_db_{name}"] = margins.gain_margin_db
        numbers[f"phase_margin_deg_{name}"] = margins.phase_margin_deg
        numbers[f"delay_margin_s_{name}"] = margins.delay_margin_s
    for name, margins in stability.worst.items():
        words = _words(margins)
        low, high = settings.margins.joint_factor_low, settings.margins.joint_factor_high
        check = f"stability with arms {low:g} to {high:g} times {name}'s"
        checks.append(yes(check, margins.stable, words, "stable", remedy))
    return checks, numbers


def _words(margins: Margins) -> str:
    if not margins.stable:
        return "unstable"
    return (
        f"{margins.gain_margin_db:.3g} dB, {margins.phase_margin_deg:.3g} deg, "
        f"bears {number(float(f'{margins.delay_margin_s:.3g}'), 's')} more delay"
    )
