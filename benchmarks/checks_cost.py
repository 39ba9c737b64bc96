"""What checks, terms and the pooled fit cost beside the fits of the epochs, in CPU time.

`estimate` runs by turns as it is and with the fits of the epochs alone, on epochs of 20 s: of a
virtual session with the perturbation recorded (`iv`), of the same without it (`bandlimited`), and
of a measured ankle where `RIGIDIMETER_SHARED` names the folder of the recordings.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks.checks_cost --epochs 12
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from benchmarks.paired import REPEATS, Row, in_ms, paired
from rigidimeter.analysis import estimation
from rigidimeter.analysis.estimation import CHECKS, estimate_recorded, prepare
from rigidimeter.analysis.reading import ReadOptions, read_recording
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.virtual.batch import simulate_epochs

VOLUNTARY = {"subject": {"OFF": {"voluntary_sd_nm": 0.1}}}
ANKLE = ReadOptions(
    columns={"angle_rad": "position_rad", "torque_nm": "torque_Nm"},
    reaction=True,
    epoch_length_s=20.0,
)


def inputs(count: int) -> dict[str, list[Epoch]]:
    """Return the epochs of each kind."""
    batch = simulate_epochs(parse_settings(VOLUNTARY), count, conditions="OFF")
    virtual = [batch.epoch(i) for i in range(count)]
    alone = [
        replace(e, channels={n: c for n, c in e.channels.items() if n != "perturbation_nm"})
        for e in virtual
    ]
    found = {"virtual, iv": virtual, "virtual, bandlimited": alone}
    shared = Path(os.environ.get("RIGIDIMETER_SHARED", ""))
    for folder in (shared / "data", shared):
        if (folder / "ankle").is_dir():
            ankle = read_recording(folder / "ankle" / "z_df.npz", ANKLE)[0]
            found["measured ankle, bandlimited"] = list(ankle[:count])
            break
    return found


def fits_alone(epochs: Sequence[Epoch]) -> None:
    """Estimate without checks of epochs, pooled fits and terms."""
    every = CHECKS[:]
    CHECKS.clear()
    try:
        estimate_recorded(prepare(epochs, Settings()), fits_alone=True)
    finally:
        CHECKS[:] = every


def rows(count: int = 6, repeats: int = REPEATS) -> list[Row]:
    """Return what an epoch costs with everything, and with its fits alone."""
    return [
        _row(f"estimate of an epoch of 20 s, {name} / its fits alone", epochs, repeats)
        for name, epochs in inputs(count).items()
    ]


def _row(name: str, epochs: Sequence[Epoch], repeats: int) -> Row:
    times_s = paired(
        lambda: estimation.estimate(epochs, Settings()),
        lambda: fits_alone(epochs),
        repeats,
        clock=time.process_time,
    )
    return in_ms(name, (times_s[0] / len(epochs), times_s[1] / len(epochs)))


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.checks_cost", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--epochs", type=int, default=6)
    parser.add_argument("--repeats", type=int, default=REPEATS)
    options = parser.parse_args(arguments)
    print("| what / reference | ours | reference | ratio |")
    print("| --- | ---: | ---: | ---: |")
    for row in rows(options.epochs, options.repeats):
        print(row)


if __name__ == "__main__":
    main()
