"""Measure side by side in one run; print medians and ratios, never a verdict.

Machines differ and are noisy, so each figure stands beside a reference that was measured in turn
with it. Run by `make bench`; a table goes to `docs/development/benchmarks.md`.

    python -m benchmarks
    python -m benchmarks --quick    # each once, on as little as possible; the page stays
"""

from __future__ import annotations

import argparse
import os
import platform
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from tests.docs.measured import between_the_marks, folded
from tests.known_joint import angle_rad, torque_nm

from benchmarks import batch, checks_cost, estimation, online
from benchmarks.paired import REPEATS, Row, in_ms, paired
from rigidimeter.analysis.reading import ReadOptions, read_recording
from rigidimeter.core.settings import parse_settings
from rigidimeter.virtual import run_virtual_session

TABLE = Path(__file__).parent.parent / "docs" / "development" / "benchmarks.md"
IMPORTS = 20
"""Repeats of what takes a second and differs by some percent."""


def session(folder: Path, seed: int) -> Path:
    """Record one PRBS epoch on the virtual rig."""
    values = {
        "seed": seed,
        "protocol": {"blocks": [{"epochs": 1}], "rests_s": [1.0], "return_s": 1.0},
    }
    run_virtual_session(parse_settings(values), folder / str(seed))
    return folder / str(seed)


def loop_against_real_time(folder: Path, repeats: int) -> Row:
    """One 21 s session as fast as it goes, against 21 s."""
    seeds = iter(range(100, 200))
    ours, _ = paired(lambda: session(folder, next(seeds)), lambda: None, repeats)
    return in_ms("virtual session of 21 s at 1 kHz, recorded / real time", (ours, 21.0))


def reading_against_numpy(folder: Path, repeats: int) -> Row:
    """A text file of 200,000 rows, against numpy.loadtxt."""
    time_s = np.arange(200_000) / 1000
    columns = np.column_stack([time_s, torque_nm(time_s), angle_rad(time_s)])
    path = folder / "recording.csv"
    np.savetxt(path, columns, delimiter=",", header="time_s,torque_nm,angle_rad", comments="")
    times_s = paired(
        lambda: read_recording(path, ReadOptions(epoch_length_s=20.0)),
        lambda: np.loadtxt(path, delimiter=",", skiprows=1),
        repeats,
    )
    return in_ms("CSV of 200,000 rows to checked epochs / numpy.loadtxt", times_s)


def import_against_scipy(folder: Path, repeats: int) -> Row:
    """CPU time of a process that takes `rigidimeter.estimate`, against one with scipy.signal.

    Both from bytecode, as an installed package is.
    """
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(folder), "PYTHONDONTWRITEBYTECODE": ""}

    def running(code: str) -> None:
        subprocess.run([sys.executable, "-c", code], check=True, env=environment)

    def of_children_s() -> float:
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    times_s = paired(
        lambda: running("import rigidimeter; rigidimeter.estimate"),
        lambda: running("import numpy, scipy.signal"),
        repeats,
        of_children_s,
    )
    return in_ms("import rigidimeter.estimate / numpy and scipy.signal, CPU", times_s)


def main() -> None:
    """Run every benchmark, print the table and write it to the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="each once, and write no page")
    quick = parser.parse_args().quick
    repeats = 1 if quick else REPEATS
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [
            import_against_scipy(folder, 1 if quick else IMPORTS),
            loop_against_real_time(folder, repeats),
            reading_against_numpy(folder, repeats),
            *(batch.rows(1, 1, (1, 2)) if quick else batch.rows()),
            *(estimation.rows(1) if quick else estimation.rows()),
            *(checks_cost.rows(1, 1) if quick else checks_cost.rows()),
            *online.rows(),
        ]
    table = [
        "| what / reference | ours | reference | ratio |",
        "| --- | ---: | ---: | ---: |",
        *map(str, rows),
    ]
    print("\n".join(table))
    if quick:
        return
    measured = (
        f"Medians of {repeats} runs, alternating ours and the reference, Python "
        f"{platform.python_version()} on {platform.machine()}."
    )
    between_the_marks(TABLE, "\n".join([measured, "", *folded(table)]))


if __name__ == "__main__":
    main()
