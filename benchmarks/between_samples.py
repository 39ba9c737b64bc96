"""J, B and K from drives of five structures, at six rates, behind four torque filters.

    python -m benchmarks.between_samples                 # everything, about ten minutes
    python -m benchmarks.between_samples PI friction     # these structures; the others stay

The rig is `tests.scenarios.drive_rig`, which shares no equation with the estimation. The tables go
to `docs/development/between-samples.md`.
"""

from __future__ import annotations

import re
import sys
from itertools import product
from pathlib import Path

import numpy as np
from tests.docs.measured import between_the_marks, folded
from tests.scenarios.drive_rig import STRUCTURES, TRUTH, DriveRig, run

from rigidimeter.analysis.recording import estimate
from rigidimeter.core.settings import parse_settings

TABLE = Path(__file__).parent.parent / "docs" / "development" / "between-samples.md"
RATES_HZ = (100.0, 200.0, 333.0, 500.0, 1000.0, 2000.0)
FIRST_HZ = (500.0, 1000.0, 333.0, 200.0, 2000.0, 100.0)
"""The same in the order in which they are run."""
FILTERS_HZ = (0.0, 30.0, 100.0, 320.0)
EPOCHS = 4
WANTED = np.array([2.0, 1.0, 0.5])
"""Largest errors of J, B and K in % of an estimate that is not flagged."""
TITLES = (
    "| samples/s | filter | J | B | K | half interval of J | covered | flagged | broken |",
    "| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
)
NOT_RUN = ["not run", "", "", "", "", "", ""]

Rows = dict[tuple[str, str, str], list[str]]


def cells(structure: str, rate_hz: float, lowpass_hz: float) -> list[str]:
    """Return what was found on one rig, as cells of its row."""
    rig = DriveRig(structure, rate_hz, lowpass_hz=lowpass_hz)
    settings = parse_settings({"estimation": {"torque_lowpass_hz": lowpass_hz}})
    fits = estimate([run(rig, seed) for seed in range(EPOCHS)], "iv", settings=settings).fits
    values, low, high = (np.array([getattr(fit, part) for fit in fits])
                         for part in ("value", "low", "high"))  # fmt: skip
    error = 100 * (values / TRUTH - 1)
    covered = (low <= TRUTH) & (high >= TRUTH)
    half = 50 * float(np.median(high[:, 0] - low[:, 0])) / TRUTH[0]
    doubted = np.array(
        ["between_samples" in {one.name for one in fit.findings} for fit in fits], dtype=bool
    )
    known = doubted[:, None] & covered
    broken = int(np.sum(np.any((np.abs(error) > WANTED) & ~known, axis=1)))
    return [
        *(f"{one:+.2f}" for one in np.mean(error, axis=0)),
        f"{half:.2f}",
        f"{np.sum(covered)}",
        f"{np.sum(doubted)}",
        f"{broken} ✗" if broken else "0",
    ]


def written(rows: Rows) -> str:
    """Return what stands between the marks of the page."""
    broken = [rig for rig, found in rows.items() if "✗" in found[-1]]
    count = len(STRUCTURES) * len(RATES_HZ) * len(FILTERS_HZ)
    said = f"{len(rows)} of {count} rows were run; {len(broken)} hold a broken epoch."
    lines = [said]
    for structure in STRUCTURES:
        lines += ["", f"## {structure[0].upper()}{structure[1:]}", ""]
        table = [*TITLES]
        for rate_hz, lowpass_hz in product(RATES_HZ, FILTERS_HZ):
            rig = (f"{rate_hz:g}", f"{lowpass_hz:g} Hz" if lowpass_hz else "none")
            found = rows.get((structure.lower(), *rig), NOT_RUN)
            table.append("| " + " | ".join([*rig, *found]) + " |")
        lines += folded(table)
    return "\n".join(lines)


def read(page: str) -> Rows:
    """Return the rows of a page that were run."""
    rows: Rows = {}
    for section in re.split(r"^## ", page, flags=re.M)[1:]:
        title, *lines = section.splitlines()
        for line in (one for one in lines if re.match(r"\| \d", one)):
            rate, corner, *found = line.strip("| ").split(" | ")
            if found != NOT_RUN:
                rows[title.lower(), rate, corner] = found
    return rows


def main() -> None:
    """Write the rows of some structures into the page, each as soon as it is known."""
    structures = sys.argv[1:] or STRUCTURES
    rows = read(TABLE.read_text(encoding="utf-8"))
    for rate_hz, structure, lowpass_hz in product(FIRST_HZ, structures, FILTERS_HZ):
        found = cells(structure, rate_hz, lowpass_hz)
        corner = f"{lowpass_hz:g} Hz" if lowpass_hz else "none"
        rows[structure.lower(), f"{rate_hz:g}", corner] = found
        print(structure, f"{rate_hz:g}", corner, *found, sep=" | ", flush=True)
        between_the_marks(TABLE, written(rows))


if __name__ == "__main__":
    main()
