"""Measure side by side in one run; print medians and ratios, never a verdict.

Machines differ and are noisy, so each figure stands beside a reference that was measured in turn
with it. Run by `make bench`; a table goes to `docs/reference/benchmarks.md`.
"""

from __future__ import annotations

import platform
import tempfile
from pathlib import Path

import numpy as np

from benchmarks.paired import REPEATS, paired
from rigidimeter.cli.virtual import run_virtual_session
from rigidimeter.estimation import METHODS, fit_epoch
from rigidimeter.recording import ReadOptions, read_recording, read_session
from rigidimeter.settings import Settings, parse_settings

TABLE = Path(__file__).parent.parent / "docs" / "reference" / "benchmarks.md"


def session(folder: Path, seed: int) -> Path:
    """Record one PRBS epoch on the virtual rig."""
    values = {
        "seed": seed,
        "protocol": {"blocks": [{"epochs": 1}], "rests_s": [1.0], "return_s": 1.0},
    }
    run_virtual_session(parse_settings(values), folder / str(seed))
    return folder / str(seed)


def loop_against_real_time(folder: Path) -> tuple[str, float, float]:
    """One 21 s session as fast as it goes, against 21 s."""
    seeds = iter(range(100, 200))
    ours, _ = paired(lambda: session(folder, next(seeds)), lambda: None)
    return "virtual session of 21 s at 1 kHz, recorded / real time", ours, 21.0


def estimate_against_lstsq(folder: Path, method: str) -> tuple[str, float, float]:
    """One epoch from raw channels to a fit, against a bare least squares on ready matrices."""
    (epoch,), _ = read_session(session(folder, 1 + list(METHODS).index(method)))
    rng = np.random.default_rng(0)
    n = len(epoch.channels["torque_nm"])
    A, b = rng.standard_normal((n, 3)), rng.standard_normal(n)
    settings = Settings().estimation
    ours, bare = paired(
        lambda: fit_epoch(epoch, method, settings), lambda: np.linalg.lstsq(A, b, rcond=None)
    )
    return f"fit of a 20 s epoch at 1 kHz, {method} / numpy.linalg.lstsq on {n} × 3", ours, bare


def reading_against_numpy(folder: Path) -> tuple[str, float, float]:
    """A text file of 200,000 rows, against numpy.loadtxt."""
    rng = np.random.default_rng(0)
    columns = np.column_stack([np.arange(200_000) / 1000, rng.standard_normal((200_000, 2))])
    path = folder / "recording.csv"
    np.savetxt(path, columns, delimiter=",", header="time_s,torque_nm,angle_rad", comments="")
    ours, reference = paired(
        lambda: read_recording(path, ReadOptions(epoch_length_s=20.0)),
        lambda: np.loadtxt(path, delimiter=",", skiprows=1),
    )
    return "CSV of 200,000 rows to checked epochs / numpy.loadtxt", ours, reference


def main() -> None:
    """Run every benchmark and write the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [
            loop_against_real_time(folder),
            *(estimate_against_lstsq(folder, method) for method in METHODS),
            reading_against_numpy(folder),
        ]
    lines = [
        "# Benchmarks",
        "",
        f"Medians of {REPEATS} runs, ours and the reference in turn, Python "
        f"{platform.python_version()} on {platform.machine()}. Written by `make bench`.",
        "",
        "| what / reference | ours (ms) | reference (ms) | ratio |",
        "| --- | ---: | ---: | ---: |",
        *(f"| {what} | {1e3 * a:.3g} | {1e3 * b:.3g} | {a / b:.3g} |" for what, a, b in rows),
    ]
    print("\n".join(lines))
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
