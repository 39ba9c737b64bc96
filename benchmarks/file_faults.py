"""Files with faults of kinds that public recordings have, and good ones: what is read and reported.

    python -m benchmarks.file_faults             # 200 and 200, some minutes
    python -m benchmarks.file_faults --files 40  # 20 and 20

Of a file with a fault, K must be right within 1 % or its interval, and the fault be reported; or
the file be refused with what would be right. Of a good one K must be right, and nothing reported.
"""

from __future__ import annotations

import argparse
import tempfile
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
from tests.known_joint import TRUTH

import rigidimeter as rm
from rigidimeter.core.errors import UserError

Array = np.ndarray
Columns = dict[str, Array]


def motion(rng: np.random.Generator, rate_hz: float, below_hz: float, length_s: float) -> Columns:
    """Return the known joint in a motion below some frequency, sampled with noise."""
    time_s = np.arange(int(length_s * rate_hz)) / rate_hz
    hz = np.arange(6, int(below_hz * length_s)) / length_s
    phase, size = rng.uniform(0, 2 * np.pi, hz.size), 1.0 / (1.0 + hz)
    size *= rng.uniform(0.02, 0.1) / np.sqrt(0.5 * np.sum(size**2))
    at = 2 * np.pi * hz * time_s[:, None] + phase
    angle, velocity, acceleration = (
        np.sum(size * (2 * np.pi * hz) ** k * np.cos(at + k * np.pi / 2), axis=1) for k in range(3)
    )
    torque = TRUTH @ np.array([acceleration, velocity, angle])
    torque += 0.003 * np.std(torque) * rng.standard_normal(time_s.size)
    return {"time_s": time_s, "torque_nm": torque, "angle_rad": angle}


def usual(rng: np.random.Generator) -> Columns:
    """Return a recording of 30 s at 100 to 500 samples/s."""
    return motion(rng, float(rng.choice([100, 200, 250, 500])), rng.uniform(6, 12), 30.0)


def lost(rng: np.random.Generator) -> tuple[Columns, dict]:
    made = usual(rng)
    channel, code = rng.choice(["torque_nm", "angle_rad"]), rng.choice([0, -9.99, -999, 32767])
    rows = rng.random(made["time_s"].size) < rng.uniform(0.003, 0.08)
    made[channel] = np.where(rows, code, made[channel])
    return made, {}


def pauses(rng: np.random.Generator) -> tuple[Columns, dict]:
    made = motion(rng, 50.0, rng.uniform(2, 3), 60.0)
    starts = np.flatnonzero(rng.random(made["time_s"].size) < rng.uniform(0.005, 0.02))
    gone = np.isin(np.arange(made["time_s"].size), (starts[:, None] + np.arange(1, 5)).ravel())
    return {name: values[~gone] for name, values in made.items()}, {}


def labels(rng: np.random.Generator) -> tuple[Columns, dict]:
    made = usual(rng)
    name = str(rng.choice(["DBS", "stim", "marker", "state", "valid", "phase", "set"]))
    n = made["time_s"].size
    return {**made, name: np.floor(np.arange(n) / n * rng.integers(2, 7)) % 2}, {}


def factors(rng: np.random.Generator) -> tuple[Columns, dict]:
    made = usual(rng)
    size = float(rng.uniform(0.2, 3))
    unit = str(rng.choice(["mV/V", "A", "mA", "%", "bar", "kPa", "bit", "raw", "ticks"]))
    made[f"torque [{unit}]"] = made.pop("torque_nm") / size
    per = f"({unit})" if "/" in unit else unit
    return made, {"scale": {"torque": f"{size!r} Nm/{per}"}}


def good(rng: np.random.Generator) -> tuple[Columns, dict]:
    made = usual(rng)
    kind = rng.integers(6)
    if kind == 1:  # a converter of 12 bits
        step = 2 * np.max(np.abs(made["torque_nm"])) / 4096
        made["torque_nm"] = np.round(made["torque_nm"] / step) * step
    elif kind == 2:  # an encoder
        made["angle_rad"] = np.round(made["angle_rad"] / 2e-4) * 2e-4
    elif kind == 3:
        made["temperature [degC]"] = np.round(
            23 + np.cumsum(rng.normal(0, 1e-3, made["time_s"].size)), 1
        )
    elif kind == 4:
        made["sample"] = np.arange(made["time_s"].size, dtype=float)
    elif kind == 5:
        made["trigger [V]"] = np.where(np.arange(made["time_s"].size) % 500 < 5, 5.0, 0.0)
    return made, {}


KINDS: dict[str, tuple[Callable[[np.random.Generator], tuple[Columns, dict]], str]] = {
    "samples lost, written as a number": (lost, "lost samples"),
    "pauses in a slow motion": (pauses, "pauses"),
    "labels that nothing uses": (labels, "is not used"),
    "factors of cells and drives": (factors, ""),
    "good": (good, ""),
}


def judged(path: Path, kind: str, rng: np.random.Generator) -> str:
    """Make, read and estimate one file; return how it went."""
    make, reported = KINDS[kind]
    columns, said = make(rng)
    np.savetxt(path, np.c_[tuple(columns.values())], delimiter=",", header=",".join(columns),
               comments="", fmt="%.9g")  # fmt: skip
    try:
        recording = rm.read(path, **said)
        fits = [fit for fit in rm.estimate(recording).fits if fit.outcome.included]
    except UserError as error:
        return f"refused: {error}"
    if not fits:
        return "wrong: nothing is left"
    for fit in fits:
        error = abs(fit.value[2] - TRUTH[2])
        if not error <= max(0.01 * TRUTH[2], 0.5 * (fit.high[2] - fit.low[2])):
            return "wrong value"
    texts = " / ".join(notice.text for notice in recording.notices)
    if len(recording.epochs) > 1:
        return f"right, in {len(recording.epochs)} pieces" if reported in texts else "unreported"
    if reported:
        return "right, reported" if reported in texts else "right, unreported"
    return "right, nothing reported" if not texts else f"right, but reported: {texts}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--files", type=int, default=400)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    rng = np.random.default_rng(chosen.seed)
    faulty = [kind for kind in KINDS if kind != "good"]
    with tempfile.TemporaryDirectory() as folder:
        for kind in KINDS:
            n = chosen.files // 2 if kind == "good" else chosen.files // 2 // len(faulty)
            found = Counter(judged(Path(folder) / "r.csv", kind, rng) for _ in range(n))
            print(f"{kind}: {n} files")
            for how, count in found.most_common():
                print(f"    {count:4d}  {how[:300]}", flush=True)


if __name__ == "__main__":
    main()
