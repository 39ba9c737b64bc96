"""Measure side by side in one run; print medians and ratios, never a verdict.

Machines differ and are noisy, so each figure stands beside a reference that was measured in turn
with it. Run by `make bench`; a table goes to `docs/reference/benchmarks.md`.
"""

from __future__ import annotations

import platform
import tempfile
from pathlib import Path

import numpy as np

from benchmarks import batch, checks_cost, estimation, online
from benchmarks.paired import REPEATS, Row, in_ms, paired
from rigidimeter.recording import ReadOptions, read_recording
from rigidimeter.settings import parse_settings
from rigidimeter.virtual.virtual_session import run_virtual_session

TABLE = Path(__file__).parent.parent / "docs" / "reference" / "benchmarks.md"
END = "<!-- measured: end -->"
"""What follows it in the page is written by hand, and stays."""


def session(folder: Path, seed: int) -> Path:
    """Record one PRBS epoch on the virtual rig."""
    values = {
        "seed": seed,
        "protocol": {"blocks": [{"epochs": 1}], "rests_s": [1.0], "return_s": 1.0},
    }
    run_virtual_session(parse_settings(values), folder / str(seed))
    return folder / str(seed)


def loop_against_real_time(folder: Path) -> Row:
    """One 21 s session as fast as it goes, against 21 s."""
    seeds = iter(range(100, 200))
    ours, _ = paired(lambda: session(folder, next(seeds)), lambda: None)
    return in_ms("virtual session of 21 s at 1 kHz, recorded / real time", (ours, 21.0))


def reading_against_numpy(folder: Path) -> Row:
    """A text file of 200,000 rows, against numpy.loadtxt."""
    rng = np.random.default_rng(0)
    columns = np.column_stack([np.arange(200_000) / 1000, rng.standard_normal((200_000, 2))])
    path = folder / "recording.csv"
    np.savetxt(path, columns, delimiter=",", header="time_s,torque_nm,angle_rad", comments="")
    times_s = paired(
        lambda: read_recording(path, ReadOptions(epoch_length_s=20.0)),
        lambda: np.loadtxt(path, delimiter=",", skiprows=1),
    )
    return in_ms("CSV of 200,000 rows to checked epochs / numpy.loadtxt", times_s)


def main() -> None:
    """Run every benchmark and write the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [
            loop_against_real_time(folder),
            reading_against_numpy(folder),
            *batch.rows(),
            *estimation.rows(),
            *checks_cost.rows(),
            *online.rows(),
        ]
    lines = [
        "# Benchmarks",
        "",
        f"Medians of {REPEATS} runs, alternating ours and the reference, Python "
        f"{platform.python_version()} on {platform.machine()}. Written by `make bench`.",
        "",
        "| what / reference | ours | reference | ratio |",
        "| --- | ---: | ---: | ---: |",
        *map(str, rows),
    ]
    print("\n".join(lines))
    by_hand = TABLE.read_text(encoding="utf-8").partition(END)[2]
    TABLE.write_text("\n".join(lines) + f"\n\n{END}{by_hand}", encoding="utf-8")


if __name__ == "__main__":
    main()
