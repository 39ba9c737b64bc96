"""What the checks of an epoch cost beside the estimate, in CPU time, in one run.

`estimate` runs by turns with every check and with none, on epochs of 20 s: of a virtual session
with the perturbation recorded (`iv`), of the same without it (`bandlimited`), and of a measured
ankle where `RIGIDIMETER_SHARED` names the folder of the recordings. With `--parts` each check is
timed too; what several checks share is with the first of them.

    python -m benchmarks.checks_cost
    python -m benchmarks.checks_cost --epochs 12 --parts
"""

from __future__ import annotations

import argparse
import contextlib
import os
import statistics
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from unittest import mock

from rigidimeter.estimation.diagnostics import CHECKS, Check
from rigidimeter.recording import ReadOptions, read_recording
from rigidimeter.records import Epoch
from rigidimeter.settings import parse_settings
from rigidimeter.study import analysis
from rigidimeter.virtual.batch import simulate_epochs

VOLUNTARY = {"subject": {"OFF": {"voluntary_sd_nm": 0.1}}}
ANKLE = ReadOptions(
    columns={"angle_rad": "position_rad", "torque_nm": "torque_Nm"},
    reaction=True,
    epoch_length_s=20.0,
)
OUTSIDE = ("checked", "checked_together", "between_epochs")
"""What `study.analysis` calls beside the estimate."""


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


@contextlib.contextmanager
def no_checks() -> Iterator[None]:
    """Let an analysis pass over every check."""

    def fit_alone(_: object, fit: object) -> object:
        return fit

    def fits_alone(*found: object) -> tuple[object, object]:
        return found[1], found[2]

    with contextlib.ExitStack() as stack:
        for name, stub in zip(OUTSIDE, (fit_alone, fits_alone, lambda *_: None), strict=True):
            stack.enter_context(mock.patch.object(analysis, name, stub))
        yield


def cpu_s(epochs: Sequence[Epoch]) -> float:
    """Return the CPU time of one estimate."""
    start_s = time.process_time()
    analysis.estimate(epochs)
    return time.process_time() - start_s


def parts_ms(epochs: Sequence[Epoch]) -> Mapping[str, float]:
    """Return the CPU time of each check in one estimate, in ms an epoch."""
    spent: dict[str, float] = defaultdict(float)

    def timed(check: Check) -> Check:
        def function(case: object) -> object:
            start_s = time.process_time()
            try:
                return check.function(case)  # type: ignore[arg-type]
            finally:
                spent[check.name] += 1e3 * (time.process_time() - start_s) / len(epochs)

        return replace(check, function=function)  # type: ignore[arg-type]

    def timed_together(*found: object) -> object:
        start_s = time.process_time()
        try:
            return together(*found)
        finally:
            spent["checked_together"] += 1e3 * (time.process_time() - start_s) / len(epochs)

    original, together = list(CHECKS), analysis.checked_together
    CHECKS[:] = [timed(check) for check in original]
    try:
        with mock.patch.object(analysis, "checked_together", timed_together):
            analysis.estimate(epochs)
    finally:
        CHECKS[:] = original
    return spent


def main(arguments: Sequence[str] | None = None) -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.checks_cost", description=(__doc__ or "").partition("\n")[0]
    )
    parser.add_argument("--epochs", type=int, default=6)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--parts", action="store_true", help="time each check too")
    options = parser.parse_args(arguments)
    print("| epochs of 20 s | without checks, ms each | with them, ms each | checks / estimate |")
    print("| --- | ---: | ---: | ---: |")
    found = inputs(options.epochs)
    for name, epochs in found.items():
        costs: tuple[list[float], list[float]] = ([], [])
        for repeat in range(options.repeats + 1):
            with no_checks():
                alone_s = cpu_s(epochs)
            with_s = cpu_s(epochs)
            if repeat:  # the first run compiles and fills caches
                costs[0].append(1e3 * alone_s / len(epochs))
                costs[1].append(1e3 * with_s / len(epochs))
        alone, whole = (statistics.median(one) for one in costs)
        print(f"| {name} | {alone:.1f} | {whole:.1f} | {whole / alone - 1:.2f} |", flush=True)
    if options.parts:
        tables = {name: parts_ms(epochs) for name, epochs in found.items()}
        print(f"\n| check, ms an epoch | {' | '.join(tables)} |")
        print(f"| --- | {' | '.join('---:' for _ in tables)} |")
        for check in dict.fromkeys(part for table in tables.values() for part in table):
            print(f"| {check} | {' | '.join(f'{t.get(check, 0):.1f}' for t in tables.values())} |")


if __name__ == "__main__":
    main()
