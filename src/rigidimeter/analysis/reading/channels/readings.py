"""What a recording looks like under each reading of its units, and which readings cannot be.

A unit that the user states is believed, with a warning; one that only the file states is not
believed where the numbers contradict it, or would rather be in the unit with which it is confused.
"""

from __future__ import annotations

import itertools
import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from rigidimeter.analysis.reading.channels.choice import MOTION, Taken
from rigidimeter.analysis.reading.channels.conversion import Conversion
from rigidimeter.analysis.reading.channels.looks import Array, Look, RoughFit, look
from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD
from rigidimeter.analysis.reading.channels.unit_text import factor
from rigidimeter.analysis.reading.channels.wrapping import unwrapped
from rigidimeter.analysis.reading.formats.columns import one_after_another

LARGEST_RAD = 2 * math.pi
LARGEST_SPEED_RAD_S = 20.0
"""A thrown ball takes more, no measured arm does; 1,150 °/s."""
LARGEST_POWER_W = 20.0
"""Of an axis that turns on, the default of `guard.power_limit_w`."""
LARGEST_TORQUE_NM = 1000.0
BELIEVED_SPEED_RAD_S, BELIEVED_TORQUE_NM = (0.2, 5.0), (0.2, 100.0)
"""Up to the second a file's word for the larger unit is believed (rad, N·m), from the first on that
for the smaller (deg, N·mm). As the units differ by 57 and 1000, no recording is believed in both.
Joints from a finger to a knee, and a human ankle, reach 0.7 to 0.9 rad/s when they are perturbed at
random, and 2.2 rad/s in a sinusoid of 20° at 1 Hz."""
MATCHING_RATIO = 1.3
"""A velocity is at most so many times as large, or as small, as the derivative of the angle: noise
of 0.5 rad/s, an encoder of 0.1° and a low-pass of 20 Hz leave 0.96 to 1.0, units are 6.3 and 57
apart."""
SLOWEST_MOTION_HZ = 0.02
SLOWEST_RATE_HZ = 5.0
FASTEST_MOTION_HZ, FASTEST_RATE_HZ = 100.0, 5e4
FEWEST = 100
SHORTEST_S = 5.0
"""What is shorter is not estimated."""
RARE_TIME_UNITS = ("us", "ns", "days")
CONFUSED: Mapping[str, tuple[str, str]] = {
    "angle_rad": ("rad", "deg"),
    "velocity_rad_s": ("rad/s", "deg/s"),
    "torque_nm": ("Nm", "Nmm"),
}
_MOST_LINES = 8
_CLEAR_R_SQUARED = 0.5
_MUCH = 0.3


@dataclass(frozen=True)
class Doubt:
    """Why a quantity's unit cannot be right, or is not believed; the units to offer, if not all.

    `beside` is a second quantity whose unit may be the wrong one instead.
    """

    standard: str
    text: str
    units: tuple[str, ...] = ()
    beside: str = ""


def doubts(seen: Look) -> list[Doubt]:
    """Return what cannot be right of a recording with torque and motion of a joint."""
    if seen.n_samples < FEWEST:
        return []
    if seen.rate_hz < SLOWEST_RATE_HZ or seen.motion_hz < SLOWEST_MOTION_HZ:
        text = f"{seen.rate_hz:.4g} samples/s and a motion of {seen.motion_hz:.2g} Hz are too slow"
        return [Doubt("time_s", text)]
    fast = seen.rate_hz > FASTEST_RATE_HZ or seen.duration_s < SHORTEST_S
    if fast and seen.motion_hz > FASTEST_MOTION_HZ:
        text = f"{seen.rate_hz:.4g} samples/s and a motion of {seen.motion_hz:.2g} Hz are too fast"
        return [Doubt("time_s", text)]
    if seen.duration_s < SHORTEST_S:
        return []
    found = []
    if seen.torque_nm > LARGEST_TORQUE_NM:
        text = f"a torque of {seen.torque_nm:.4g} N·m is too large"
        found.append(Doubt("torque_nm", text, CONFUSED["torque_nm"]))
    turns_on = seen.turned_rad >= 0.5 * seen.range_rad and seen.power_w <= LARGEST_POWER_W
    if seen.largest_rad > LARGEST_RAD and not turns_on:
        text = f"an angle of {seen.largest_rad:.4g} rad is more than one turn"
        found.append(Doubt("angle_rad", text))
    elif not turns_on:
        found += [
            Doubt(name, f"a speed of {speed:.4g} rad/s is too fast for a limb")
            for name, speed in _speeds(seen).items()
            if speed > LARGEST_SPEED_RAD_S
        ]
    ratio = seen.velocity_ratio
    if not (found or math.isnan(ratio) or 1 / MATCHING_RATIO <= ratio <= MATCHING_RATIO):
        text = f"the velocity is {ratio:.3g} times the derivative of the angle"
        found.append(Doubt("velocity_rad_s", text, beside="angle_rad"))
    return found


def _speeds(seen: Look) -> dict[str, float]:
    """Return the speed of each motion by which its unit can be judged.

    That of a velocity beside an angle is judged by the angle, where it follows the angle.
    """
    if math.isnan(seen.largest_rad):
        return {"velocity_rad_s": seen.speed_rad_s}
    speeds = {"angle_rad": seen.speed_rad_s, "velocity_rad_s": seen.velocity_speed_rad_s}
    if not math.isnan(seen.velocity_ratio) or math.isnan(seen.velocity_speed_rad_s):
        del speeds["velocity_rad_s"]
    return speeds


def confusions(seen: Look, factors: Mapping[str, float]) -> list[Doubt]:
    """Return the units that a file states, while the numbers look like those of another.

    Parameters
    ----------
    seen : Look
    factors : mapping of str to float
        What 1 of the stated unit is in SI, of the torque and the motion that were looked at.
    """
    if seen.n_samples < FEWEST or seen.duration_s < SHORTEST_S:
        return []
    turns_on = seen.turned_rad >= 0.5 * seen.range_rad and seen.power_w <= LARGEST_POWER_W
    measured = {"torque_nm": seen.torque_nm}
    if not turns_on:
        measured |= _speeds(seen)
    found = []
    for standard in (name for name in measured if name in factors):
        units = CONFUSED[standard]
        of_torque = standard == "torque_nm"
        low, high = BELIEVED_TORQUE_NM if of_torque else BELIEVED_SPEED_RAD_S
        sizes = [factor(unit, standard) or 1.0 for unit in units]
        stated = [k for k in (0, 1) if math.isclose(factors[standard], sizes[k], rel_tol=1e-3)]
        value = measured[standard]
        if not stated or (low <= value if stated[0] else value <= high):
            continue
        other = value * sizes[1 - stated[0]] / sizes[stated[0]]
        what = (("large", "small") if of_torque else ("fast", "slow"))[stated[0]]
        si = "N·m" if of_torque else "rad/s"
        text = f"{value:.3g} {si} is unusually {what}; in {units[1 - stated[0]]} it is {other:.3g}"
        found.append(Doubt(standard, f"{text} {si}", units))
    return found


def sign_fault(seen: Look, columns: Mapping[str, str], *, reaction: bool) -> str:
    """Say where torque and motion have signs, or names, that no joint has; nothing where not.

    Parameters
    ----------
    seen : Look
    columns : mapping of str to str
        The columns of the torque and, second, of the motion.
    reaction : bool
        Whether the sign of the torque was turned.
    """
    fit, swapped = seen.fit, seen.swapped
    if fit is None or seen.duration_s < SHORTEST_S:
        return ""
    signs = fit.significant
    shown = " and ".join(repr(column) for column in columns.values())
    if swapped is not None and _exchanged(fit, swapped):
        exchanged = zip(columns, reversed([*columns.values()]), strict=True)
        options = " ".join(
            f"--column {shlex.quote(f'{name}={column}')}" for name, column in exchanged
        )
        return (
            f"{shown} are exchanged: as they are, {_fit_text(seen)} with R² "
            f"{fit.r_squared:.2f}; the other way round the signs are those of a joint, with R² "
            f"{swapped.r_squared:.2f}; say {options} and the unit of each"
        )
    if np.all(signs < 0) and fit.r_squared > _CLEAR_R_SQUARED:
        remedy = "leave out --reaction" if reaction else "say --reaction"
        return (
            f"{shown} give {_fit_text(seen)}: the torque has the sign of the joint's reaction, or "
            f"the angle is reversed; {remedy}"
        )
    return ""


def _exchanged(fit: RoughFit, swapped: RoughFit) -> bool:
    """Whether the angle is explained by the torque as a torque is by the motion, and far better."""
    left, left_swapped = 1.0 - fit.r_squared, 1.0 - swapped.r_squared
    one_sign = abs(float(np.sum(swapped.significant))) == 3.0
    return one_sign and left_swapped < _MUCH * left and swapped.r_squared > _CLEAR_R_SQUARED


def readings(
    taken: Mapping[str, Taken],
    raw: Mapping[str, Array],
    rate_hz: float | None,
    vary: Mapping[str, tuple[str, ...]],
) -> list[str]:
    """Return a line for each reading of the quantities in `vary`, in the units named or usual.

    Parameters
    ----------
    taken : mapping of str to Taken
    raw : mapping of str to array, shape (n,)
        The columns as they are, by standard name, of numbers or NaN.
    rate_hz : float or None
        Where there is no column of time.
    vary : mapping of str to tuple of str
    """
    motion = "angle_rad" if "angle_rad" in raw else "velocity_rad_s"
    varied = [name for name in ("time_s", "torque_nm", motion) if name in vary]
    if not varied:  # a velocity beside an angle: J, B and K are by the angle
        return []
    usual = {name: vary[name] or usual_units(name, taken, raw) for name in varied}
    lines = []
    for units in itertools.product(*usual.values()):
        as_units = dict(zip(varied, units, strict=True))
        seen = look_at(taken, raw, rate_hz, as_units)
        if seen is None:
            continue
        names = ", ".join(f"{BY_STANDARD[n].name} as {unit}" for n, unit in as_units.items())
        doubt = "; ".join(one.text for one in doubts(seen))
        lines.append(f"  {names}: {look_text(seen)}" + (f" ({doubt})" if doubt else ""))
    return lines[:_MOST_LINES]


def usual_units(
    standard: str, taken: Mapping[str, Taken], raw: Mapping[str, Array]
) -> tuple[str, ...]:
    """Return the usual units of a quantity; of a time that is neither in s nor in ms, more."""
    usual = BY_STANDARD[standard].usual
    if standard != "time_s" or "time_s" not in raw:
        return usual
    if _possible(usual, taken, raw):
        return usual
    return _possible(RARE_TIME_UNITS, taken, raw) or (*usual, *RARE_TIME_UNITS)


def _possible(
    units: tuple[str, ...], taken: Mapping[str, Taken], raw: Mapping[str, Array]
) -> tuple[str, ...]:
    """Return those of some units of the time with which a recording may be one."""
    seen = {unit: look_at(taken, raw, None, {"time_s": unit}) for unit in units}
    return tuple(
        unit
        for unit, one in seen.items()
        if one is None or all(doubt.standard != "time_s" for doubt in doubts(one))
    )


def look_at(
    taken: Mapping[str, Taken],
    raw: Mapping[str, Array],
    rate_hz: float | None,
    as_units: Mapping[str, str],
) -> Look | None:
    """Look at columns in the units that are stated, or in those of `as_units`; None if too few."""
    motion = "angle_rad" if "angle_rad" in raw else "velocity_rad_s"
    if "torque_nm" not in raw or motion not in raw:
        return None

    def si(name: str) -> Array:
        values = raw[name].astype(np.float64)
        to_si = taken[name].to_si
        if name in as_units:
            to_si = Conversion(factor(as_units[name], name) or 1.0)
        values = values if to_si is None else to_si(values)
        return unwrapped(values)[0] if name == "angle_rad" else values

    time_s = si("time_s") if "time_s" in raw else np.arange(raw[motion].size) / (rate_hz or 1.0)
    time_s = one_after_another(time_s)
    signals = {}
    for name in ("torque_nm", *MOTION):
        if name in raw:
            values = si(name)
            here = np.isfinite(values) & np.isfinite(time_s)
            if np.count_nonzero(here) >= 2:
                signals[name] = time_s[here], values[here]
    if "torque_nm" not in signals or motion not in signals:
        return None
    beside = signals.get("velocity_rad_s") if motion == "angle_rad" else None
    return look(signals["torque_nm"], signals[motion], beside, is_angle=motion == "angle_rad")


def matching_text(
    taken: Mapping[str, Taken], raw: Mapping[str, Array], rate_hz: float | None
) -> str:
    """Return the option with which a velocity is the derivative of the angle beside it."""
    options = []
    for name in ("velocity_rad_s", "angle_rad"):
        for unit in BY_STANDARD[name].usual:
            seen = look_at(taken, raw, rate_hz, {name: unit})
            if seen is not None and not doubts(seen):
                options.append(f"--unit {BY_STANDARD[name].name}={unit}")
    if not options:
        turned = {**raw, "velocity_rad_s": -raw["velocity_rad_s"]}
        seen = look_at(taken, turned, rate_hz, {})
        if seen is not None and not doubts(seen):
            options.append("--scale velocity=-1")
    remedy = f"say {' or '.join(options)}" if options else "check both units and the rate"
    return f"{remedy}; if both units are right, say --unit for both"


def options_text(vary: Mapping[str, tuple[str, ...]]) -> str:
    """Return the options that would state the units of some quantities, those named or usual."""
    return "; ".join(
        " or ".join(
            f"--unit {BY_STANDARD[name].name}={shlex.quote(unit)}"
            for unit in units or BY_STANDARD[name].usual
        )
        for name, units in vary.items()
    )


def look_text(seen: Look) -> str:
    """Return a look as one line: rate, duration, speed, and J, B and K."""
    speed = f"peak speed {seen.speed_rad_s:.3g} rad/s"
    rate = f"{seen.rate_hz:.4g} samples/s for {seen.duration_s:.4g} s"
    return f"{rate}, {speed}, {_fit_text(seen)}"


def _fit_text(seen: Look) -> str:
    if seen.fit is None:
        return "J, B and K are unknown"
    inertia, damping, stiffness = seen.fit.value
    return f"J {inertia:.2g} kg·m², B {damping:.2g} N·m·s/rad, K {stiffness:.2g} N·m/rad"
