"""What a rig shows while nothing is commanded: facts, rates, what was lost, noise, lateness."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from rigidimeter.core.settings import Settings
from rigidimeter.rig.commissioning.checks import RigCheck, above, below, impossible, with_unit, yes
from rigidimeter.rig.commissioning.trials import Array, Readings, new_samples
from rigidimeter.rig.guard import Cause

BAD_COUNTS = ("lost", "damaged", "short", "reordered", "repeated", "refused", "unsent")
MIN_VALUES = 3
AHEAD_S = 1e-3
"""A reading may come so much after the time that its tick notes."""

NOISE = "torque noise (SD)"
BRAKING = "braking_rad_s2"
"""What a drive's facts call the slowest of its own ways to brake."""


def facts_checks(facts: Mapping[str, Any], settings: Settings) -> list[RigCheck]:
    """Check what the devices said of themselves, and hold it against guard and loop."""
    sensor, drive = facts["torque_sensor"], facts["drive"]
    who = [f"{found['model'] or 'unknown'} {found['serial']}".strip() for found in (sensor, drive)]
    watchdog_s = drive["watchdog_s"]
    checks = [yes("devices read back", True, ", ".join(who), "what the rig file says", "")]
    name, what = "watchdog configured", "the drive must stop by itself when nobody commands it"
    longest_s = settings.commissioning.max_watchdog_s
    if watchdog_s is None:
        limit = f"at most {with_unit(longest_s, 's')}"
        checks.append(yes(name, False, "none", limit, f"{what}; set it"))
    else:
        remedy = f"{what}; shorten its watchdog in the rig file"
        checks.append(below(name, watchdog_s, "s", longest_s, remedy))
        stall_s = settings.loop.stall_s
        checks.append(
            yes(
                "loop stalls before the watchdog",
                stall_s < watchdog_s,
                with_unit(stall_s, "s"),
                f"below the drive's {with_unit(watchdog_s, 's')}",
                f"set loop.stall_s in the settings below {watchdog_s:g} s: after a longer "
                "standstill the drive has stopped by itself, and the loop would go on as if it had "
                "not",
            )
        )
    # The guard counts on a drive that brakes no slower than this.
    name, wanted = "braking of the drive", settings.guard.acceleration_limit_deg_s2
    braking_rad_s2 = drive["values"].get(BRAKING)
    if braking_rad_s2 is None:
        why = f"the driver does not say how hard its drive brakes; let its facts have {BRAKING}"
        return [*checks, impossible(name, f"at least {wanted:.4g} deg/s²", why)]
    remedy = (
        "the guard brakes for the position limit with guard.acceleration_limit_deg_s2, and this "
        "drive would cross it: raise the drive's decelerations in the rig file, or lower the "
        "guard's limit in the settings"
    )
    return [*checks, above(name, math.degrees(braking_rad_s2), "deg/s²", wanted, remedy)]


def rate_checks(
    role: str,
    time_s: Array,
    stamps_s: Array,
    expected_hz: float,
    settings: Settings,
) -> list[RigCheck]:
    """Check that new samples come often enough, never stay away, and are stamped when taken.

    Parameters
    ----------
    role : {"torque", "motion"}
    time_s, stamps_s : array, shape (n,)
        When each tick ran, and the stamp of its reading.
    expected_hz : float
        What the settings say of this sensor.
    """
    stamps = stamps_s[new_samples(stamps_s)]
    stamps = stamps[np.isfinite(stamps)]
    span_s = float(stamps[-1] - stamps[0]) if len(stamps) > 1 else 0.0
    rate_hz = (len(stamps) - 1) / span_s if span_s > 0 else 0.0
    wanted_hz = (
        0.01 * settings.commissioning.min_rate_percent * min(expected_hz, settings.rig.tick_rate_hz)
    )
    gap_s = float(np.max(np.diff(stamps))) if len(stamps) > 1 else math.inf
    ages_s = (time_s - stamps_s)[np.isfinite(stamps_s)]
    usual_s, oldest_s = (np.median(ages_s), ages_s.max()) if len(ages_s) else (math.inf, math.inf)
    stale_s = settings.guard.stale_s
    return [
        yes(
            f"age of {role} samples",
            bool(usual_s >= -AHEAD_S and oldest_s <= stale_s),
            f"{with_unit(usual_s, 's')}, at most {with_unit(oldest_s, 's')}",
            f"above 0, at most {with_unit(stale_s, 's')}",
            "a stamp must be the time of the loop's clock at which the sample was taken: check "
            "the clock that the driver takes it from, and the rate that the device states",
        ),
        above(
            f"{role} samples",
            rate_hz,
            "1/s",
            wanted_hz,
            f"raise the device's rate, or lower rig.{role}.rate_hz in the settings to it",
        ),
        below(
            f"longest gap between {role} samples",
            gap_s,
            "s",
            0.5 * settings.guard.stale_s,
            "keep the wire for itself and the computer free, or raise guard.stale_s if that is "
            "safe",
        ),
    ]


def bad_counts(counts: Mapping[str, int]) -> dict[str, int]:
    """Return the counts of messages that were lost, damaged or out of order."""
    return {name: count for name, count in counts.items() if name.endswith(BAD_COUNTS)}


def lost_check(
    before: Mapping[str, int], after: Mapping[str, int], limit_percent: float
) -> RigCheck:
    """Check that what the wires counted as lost or damaged is next to nothing."""
    gone = {name: count - before.get(name, 0) for name, count in after.items()}
    received = sum(count for name, count in gone.items() if name.endswith("_received"))
    bad = bad_counts(gone)
    total = sum(bad.values())
    percent = 100.0 * total / received if received else (100.0 if total else 0.0)
    worst = ", ".join(f"{name} {count}" for name, count in bad.items() if count)
    remedy = f"check cables, switches and other traffic ({worst})"
    return below("lost or damaged messages", percent, "%", limit_percent, remedy)


def noise_checks(readings: Readings, settings: Settings) -> list[RigCheck]:
    """Check torque at rest: it varies, but little, and is near zero."""
    zeroing = settings.zeroing
    fresh = new_samples(readings.torque_time_s) & np.isfinite(readings.torque_nm)
    torque = readings.torque_nm[fresh]
    values = np.unique(torque)
    step_nm = float(np.min(np.diff(values))) if len(values) > 1 else math.inf
    causes = readings.cause[readings.cause != int(Cause.NONE)]
    why = Cause(int(causes[0])).sentence if len(causes) else "no fault"
    return [
        yes(
            "faults at rest",
            not len(causes),
            why,
            "none",
            "remove the reason; nothing works with it",
        ),
        above(
            "different torque values",
            float(len(values)),
            "1",
            MIN_VALUES,
            "a torque that never changes is no measurement: check sensor, amplifier and cable",
        ),
        below(
            "torque step",
            step_nm,
            "N·m",
            zeroing.noise_limit_nm,
            "the sensor is too coarse: choose a finer calibration",
        ),
        below(
            NOISE,
            float(np.std(torque, ddof=1)) if len(torque) > 1 else math.inf,
            "N·m",
            zeroing.noise_limit_nm,
            "nobody may touch the rig meanwhile; check shielding, cable and drive noise, or "
            "raise zeroing.noise_limit_nm",
        ),
        below(
            "torque at rest",
            float(np.abs(np.mean(torque))) if len(torque) else math.inf,
            "N·m",
            zeroing.bias_limit_nm,
            "take the load off and zero the sensor, or check its calibration",
        ),
    ]


def measured_noise_nm(checks: Sequence[RigCheck]) -> float | None:
    """Return the standard deviation of the torque at rest; None if it was not measured."""
    values = [check.value for check in checks if check.name == NOISE]
    return values[0] if values and isinstance(values[0], float) else None


def lateness(readings: Readings, settings: Settings) -> RigCheck:
    """Check that 999 of 1000 ticks begin before the next is due."""
    return below(
        "lateness of the loop (p99.9)",
        float(np.quantile(readings.lateness_s, 0.999)),
        "s",
        1.0 / settings.rig.tick_rate_hz,
        "give the loop a processor of its own and a real-time priority, or lower rig.tick_rate_hz",
    )
