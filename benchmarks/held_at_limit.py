"""When a joint that comes to its position limit is held, and which subjects are never held.

Epochs of the virtual rig without the law, so that each goes on to its end; what the position limit
held back then passes `rig.guard.contact_step` with the guard's own limits. Beside it stands the law
before it: one second in one piece. The speed of arrival is that of the joint at the first tick of
an arrival. An offset is added to every torque sample.

    python -m benchmarks.held_at_limit --hours 20
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.false_alarms import KINDS, RATES, RESISTED, SIZES
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.core.units import deg_from_rad
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.guard import (
    ContactState,
    GuardLimits,
    contact_state,
    contact_step,
    guard_limits,
)
from rigidimeter.virtual.batch import bench, draw_inputs, simulate_inputs, with_helpers

EPOCH_S = 30.0
CHUNK = 16
ONE_PIECE_S = 1.0
COGWHEEL_HZ = 7.0
SPREAD = {f"{what}_cv_percent": 20.0 for what in ("inertia", "damping", "stiffness")}

SOUND: dict[str, dict[str, float]] = {
    "relaxed, 0.05 N·m": {"voluntary_sd_nm": 0.05},
    "pushing 0.3 N·m": {"voluntary_sd_nm": 0.3},
    "pushing 0.5 N·m": {"voluntary_sd_nm": 0.5},
    **{
        f"tremor 1 N·m, {hz:g} Hz": {
            "voluntary_sd_nm": 0.05,
            "tremor_amplitude_nm": 1.0,
            "tremor_frequency_hz": hz,
        }
        for hz in (4.0, 5.0, 6.0, 8.0, 12.0)
    },
    "cogwheel 0.3 N·m": {"voluntary_sd_nm": 0.05, "cogwheel_nm": 0.3},
    "cogwheel 1 N·m": {"voluntary_sd_nm": 0.05, "cogwheel_nm": 1.0},
    "pushing 1 N·m": {"voluntary_sd_nm": 1.0},
}
OFFSETS_NM = {"small": (0.5, 0.9, 1.1, 1.3), "human elbow": (5.0, 6.0, 6.5, 7.0)}
"""Subjects with a sound sensor, and offsets that a relaxed arm without scatter balances near
its limit of 40 deg: 1.1 N·m at 36 deg on the small joint, 6.5 N·m at 37 deg on the elbow."""


class Row(NamedTuple):
    """One line of the table: whose arm, on which rig, and what is added to it."""

    size: str
    name: str
    settings: Settings
    offset_nm: float = 0.0
    cogwheel_nm: float = 0.0


class Counted(NamedTuple):
    """What came of one row; times in s, NaN where it never came to that."""

    hours: float
    arrivals: int
    fastest_rad_s: float
    in_one_piece: int
    held: int
    latest_s: float


def rows(known: bool) -> Iterator[Row]:
    """Yield subjects and offsets, or the subjects of `benchmarks.false_alarms`."""
    for size, given in SIZES.items():
        if known:
            for name, (factors, subject) in KINDS.items():
                guard = RESISTED if name == "resisting" else {}
                yield Row(size, name, _settings(given, factors, subject, guard))
            continue
        for name, added in SOUND.items():
            subject = {key: v for key, v in added.items() if key not in Row._fields}
            row = Row(size, name, _settings(given, (1.0, 1.0, 1.0), subject, {}))
            yield row._replace(**{key: v for key, v in added.items() if key in Row._fields})
        for offset_nm in OFFSETS_NM[size]:
            nominal = {"voluntary_sd_nm": 0.05, **dict.fromkeys(SPREAD, 0.0)}
            settings = _settings(given, (1.0, 1.0, 1.0), nominal, {})
            yield Row(size, f"offset {offset_nm:g} N·m", settings, offset_nm)


def _settings(
    given: dict[str, Any],
    factors: tuple[float, ...],
    subject: dict[str, float],
    guard: dict[str, Any],
) -> Settings:
    joint = [value * factor for value, factor in zip(given["joint"], factors, strict=True)]
    names = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
    tick_hz, torque_hz, own, controller = RATES[0]
    return parse_settings(
        {
            "subject": {"OFF": {**dict(zip(names, joint, strict=True)), **SPREAD, **subject}},
            "controller": {**given["controller"], **controller},
            "prbs": {**given["prbs"], "duration_s": EPOCH_S},
            "guard": {**own, **guard},
            "rig": {
                "tick_rate_hz": tick_hz,
                "torque": {"rate_hz": torque_hz},
                "motion": {"rate_hz": tick_hz},
            },
        }
    )


def walk(
    limits: GuardLimits, state: ContactState, at_limit: NDArray[np.bool_]
) -> tuple[int, int, int]:
    """Return the tick at which the law holds, that at which a second in one piece does, and the
    arrivals until the law; a tick is -1 where there is none."""
    held = piece = -1
    run = arrivals = 0
    for k in range(at_limit.size):
        run = run + 1 if at_limit[k] else 0
        if piece < 0 and run * limits.interval_s > ONE_PIECE_S:
            piece = k
        state = contact_step(state, at_limit[k], 1, limits.interval_s, limits.apart_s)
        if held < 0:
            arrivals = state.arrivals
            over = state.ticks * limits.interval_s > limits.at_limit_s
            if over or state.three_s <= limits.arrivals_s:
                held = k
    return held, piece, arrivals


def compiled() -> Callable[..., tuple[int, int, int]]:
    """Return `walk`, compiled from the sources."""
    from numba import njit

    step = njit(with_helpers(contact_step, {}), error_model="numpy")
    made: Callable[..., tuple[int, int, int]] = njit(
        with_helpers(walk, {"contact_step": step}), error_model="numpy"
    )
    return made


def count(row: Row, hours: float, seed: int, find: Callable[..., tuple[int, int, int]]) -> Counted:
    """Simulate a row for so long and count."""
    settings = row.settings
    limits = guard_limits(settings)
    rate_hz = settings.rig.tick_rate_hz
    made = bench(settings, round(EPOCH_S * rate_hz))
    free = limits._replace(at_limit_s=math.inf, arrivals_s=0.0)
    made = dataclasses.replace(made, coefficients=made.coefficients._replace(limits=free))
    (subject,) = settings.subject.values()
    rng = np.random.default_rng(seed)
    burst = np.maximum(np.sin(2.0 * math.pi * COGWHEEL_HZ * np.arange(made.ticks) / rate_hz), 0.0)
    epochs = math.ceil(hours * 3600.0 / EPOCH_S)
    ticks = arrivals = in_one_piece = held = 0
    fastest = 0.0
    latest_s = math.nan
    for start in range(0, epochs, CHUNK):
        inputs = [draw_inputs(made, subject, rng) for _ in range(min(CHUNK, epochs - start))]
        inputs = [
            dataclasses.replace(
                one,
                noise_nm=one.noise_nm + row.offset_nm,
                voluntary_nm=one.voluntary_nm - row.cogwheel_nm * burst,
            )
            for one in inputs
        ]
        batch = simulate_inputs(made, prbs_nm(settings.prbs, rate_hz), inputs)
        for i in range(len(batch)):
            n = int(batch.ticks[i])
            at_limit = batch.limited[i, :n] == 3
            at, piece, came = find(limits, contact_state(limits.interval_s, 5.0), at_limit)
            ticks += n
            arrivals += came
            in_one_piece += piece >= 0
            if at >= 0:
                held += 1
                latest_s = np.fmax(latest_s, at / rate_hz)
            if at_limit.any():
                first = np.flatnonzero(at_limit)[0]
                fastest = max(fastest, abs(float(batch.velocity_rad_s[i, first])))
    return Counted(ticks / rate_hz / 3600.0, arrivals, fastest, in_one_piece, held, float(latest_s))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--hours", type=float, default=10.0, help="simulated, over all rows")
    parser.add_argument("--known", action="store_true", help="those of benchmarks.false_alarms")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    every, find = list(rows(given.known)), compiled()
    print(f"Epochs of {EPOCH_S:g} s. Held before: one second at the limit in one piece.\n")
    print("| size | subject | hours | arrivals | fastest arrival | before | now | latest |")
    print("| --- | --- | --- | --- | --- | --- | --- | --- |")
    for number, row in enumerate(every):
        found = count(row, given.hours / len(every), given.seed + number, find)
        epochs = round(found.hours * 3600.0 / EPOCH_S)
        fastest = f"{deg_from_rad(found.fastest_rad_s):.0f} deg/s" if found.arrivals else "–"
        latest = f"{found.latest_s:.1f} s" if found.held else "–"
        print(
            f"| {row.size} | {row.name} | {found.hours:.2f} | {found.arrivals} | {fastest} "
            f"| {found.in_one_piece} of {epochs} | {found.held} of {epochs} | {latest} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
