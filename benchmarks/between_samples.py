"""J, B and K from drives of five structures, at six rates, behind four torque filters.

    python -m benchmarks.between_samples                 # everything, about ten minutes
    python -m benchmarks.between_samples PI friction     # these structures; the others stay

The rig is `tests.scenarios.drive_rig`, which shares no equation with the estimation. The tables go
to `docs/reference/between-samples.md`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tests.scenarios.drive_rig import STRUCTURES, TRUTH, DriveRig, run

from rigidimeter.settings import parse_settings
from rigidimeter.study import estimate

TABLE = Path(__file__).parent.parent / "docs" / "reference" / "between-samples.md"
RATES_HZ = (100.0, 200.0, 333.0, 500.0, 1000.0, 2000.0)
FILTERS_HZ = (0.0, 30.0, 100.0, 320.0)
EPOCHS = 4
WANTED = np.array([2.0, 1.0, 0.5])
"""Largest errors of J, B and K in % of an estimate that is not doubted."""

HEAD = f"""# Motion between the samples

Measured with `python -m benchmarks.between_samples`: a relaxed subject on a simulator of its own in
continuous time, {EPOCHS} epochs of 20 s, `iv`, drives of 50 Hz, J 0.0045 kg·m², B 0.1368 N·m·s/rad,
K 1.751 N·m/rad. Torque, motion and command have the rate of the loop; the filter is a Butterworth
low-pass of second order, and `estimation.torque_lowpass_hz` is its corner. Mean errors, and half
the interval of J, in %; "covered" counts intervals of J, B and K that hold the truth, of
{3 * EPOCHS}; "doubted" counts epochs with the finding `between_samples`. ✗ marks a row that is
neither within 2, 1 and 0.5 % nor doubted throughout.
[What happens between the samples](../explanation/between-samples.md) explains the method.
"""


def row(structure: str, rate_hz: float, lowpass_hz: float) -> str:
    """Return the row of one rig."""
    rig = DriveRig(structure, rate_hz, lowpass_hz=lowpass_hz)
    settings = parse_settings({"estimation": {"torque_lowpass_hz": lowpass_hz}})
    fits = estimate([run(rig, seed) for seed in range(EPOCHS)], "iv", settings=settings).fits
    values, low, high = (np.array([getattr(fit, part) for fit in fits])
                         for part in ("value", "low", "high"))  # fmt: skip
    error = 100 * (np.mean(values, axis=0) / TRUTH - 1)
    covered = int(np.sum((low <= TRUTH) & (high >= TRUTH)))
    half = 50 * float(np.median(high[:, 0] - low[:, 0])) / TRUTH[0]
    doubted = sum("between_samples" in {one.name for one in fit.findings} for fit in fits)
    wrong = not np.all(np.abs(error) < WANTED) and doubted < EPOCHS
    corner = f"{lowpass_hz:g} Hz" if lowpass_hz else "none"
    cells = [f"{rate_hz:g}", corner, *(f"{one:+.2f}" for one in error), f"{half:.2f}"]
    return "| " + " | ".join([*cells, f"{covered}", f"{doubted}{' ✗' if wrong else ''}"]) + " |"


def section(structure: str) -> list[str]:
    """Return the table of one structure."""
    lines = [
        f"## {structure[0].upper()}{structure[1:]}",
        "",
        "| samples/s | filter | J | B | K | half interval of J | covered | doubted |",
        "| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |",
    ]
    print("\n".join(lines), flush=True)
    for rate_hz in RATES_HZ:
        for lowpass_hz in FILTERS_HZ:
            lines.append(row(structure, rate_hz, lowpass_hz))
            print(lines[-1], flush=True)
    return lines


def main(structures: Sequence[str]) -> None:
    """Write the tables of some structures into the page."""
    page = TABLE.read_text(encoding="utf-8") if TABLE.exists() else ""
    kept = {text.splitlines()[0].lower(): text for text in re.split(r"^## ", page, flags=re.M)[1:]}
    for structure in structures or STRUCTURES:
        kept[structure.lower()] = "\n".join(section(structure))[3:]
    tables = [f"## {kept[name.lower()].strip()}\n" for name in STRUCTURES if name.lower() in kept]
    TABLE.write_text("\n".join([HEAD, *tables]), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
