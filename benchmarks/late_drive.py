"""J, B and K behind a late drive and with a noisy tachometer, by what was recorded.

    python -m benchmarks.late_drive          # 400 epochs a row, about 15 minutes
    python -m benchmarks.late_drive 4        # so many recordings of forty epochs a row

The rig is `tests.scenarios.late_drive_rig`, which shares no equation with the estimation. The table
goes to `docs/development/late-drive.md`.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from tests.docs.measured import between_the_marks, folded
from tests.scenarios.late_drive_rig import LateRig, simulate

from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.core.settings import parse_settings

Array = NDArray[np.float64]

TABLE = Path(__file__).parent.parent / "docs" / "development" / "late-drive.md"
EPOCHS, RECORDINGS = 40, 10
ALWAYS = ("torque_nm", "angle_rad", "perturbation_nm")
RECORDED = {
    "torque, angle": ALWAYS,
    "+ command": (*ALWAYS, "velocity_command_rad_s"),
    "+ command, velocity": (*ALWAYS, "velocity_command_rad_s", "velocity_rad_s"),
}
RIGS = {
    "second order, 25 Hz, 2.3 ms late, 1000 ticks/s": LateRig(),
    "first order, 26.5 Hz, 500 ticks/s": LateRig(order=1, drive_hz=26.5, late_s=0.0, tick_hz=500.0),
}
LIMBS = {"human": tuple(RIGS), "small": tuple(RIGS)[:1]}
"""Of which rigs."""


class Row(NamedTuple):
    """What the epochs of a row gave, in % of the truth, each of shape (3,), and how many."""

    bias: Array
    scatter: Array
    half: Array
    covered: Array
    flagged: float
    epochs: int


def row(rig: LateRig, names: Sequence[str], recordings: int) -> Row:
    """Return a row; each recording has its own drive identified."""
    fits = []
    for recording in range(recordings):
        epochs = [
            replace(epoch, channels={name: epoch.channels[name] for name in names})
            for epoch in simulate(rig, recording, EPOCHS)
        ]
        recorded = prepare(epochs, parse_settings(rig.settings()))
        fits += estimate_recorded(recorded, "iv", fits_alone=True).fits
    value, low, high = (np.array([getattr(fit, part) for fit in fits])
                        for part in ("value", "low", "high"))  # fmt: skip
    truth = rig.truth
    error = 100 * (value / truth - 1)
    flagged = ["between_samples" in {one.name for one in fit.findings} for fit in fits]
    return Row(
        np.mean(error, axis=0),
        np.std(error, axis=0, ddof=1),
        50 * np.median(high - low, axis=0) / truth,
        100 * np.mean((low <= truth) & (truth <= high), axis=0),
        100 * float(np.mean(flagged)),
        len(fits),
    )


def cells(found: Row) -> list[str]:
    """Return a row as cells of the table."""
    digits = {"bias": "+.2f", "scatter": ".2f", "half": ".2f", "covered": ".0f"}
    parts = [" ".join(f"{x:{form}}" for x in getattr(found, part)) for part, form in digits.items()]
    return [*parts, f"{found.flagged:.0f}"]


TITLES = (
    "| limb | recorded | bias of J, B, K | SD | half interval | held | between_samples |",
    "| --- | --- | --- | --- | --- | --- | ---: |",
)


def table(recordings: int) -> list[str]:
    """Return what stands between the marks of the page."""
    epochs = recordings * EPOCHS
    error = 100 * np.sqrt(0.95 * 0.05 / epochs)
    lines = [
        f"{epochs} epochs a row; the standard error of a coverage of 95 % is {error:.1f} points."
    ]
    for title, rig in RIGS.items():
        lines += ["", f"## Drive of {title}", ""]
        rows = [*TITLES]
        limbs = [limb for limb, rigs in LIMBS.items() if title in rigs]
        for limb, pushing in product(limbs, (False, True)):
            for names, channels in RECORDED.items():
                found = row(replace(rig, limb=limb, pushing=pushing), channels, recordings)
                who = f"{limb}, {'pushing' if pushing else 'relaxed'}"
                rows.append("| " + " | ".join([who, names, *cells(found)]) + " |")
                print(title, rows[-1], flush=True)
        lines += folded(rows)
    return lines


def main() -> None:
    """Measure the table and write it; fewer recordings are only printed."""
    recordings = int(sys.argv[1]) if len(sys.argv) > 1 else RECORDINGS
    lines = table(recordings)
    if recordings == RECORDINGS:
        between_the_marks(TABLE, "\n".join(lines))


if __name__ == "__main__":
    main()
