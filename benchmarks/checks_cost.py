"""What the checks of an epoch cost beside the estimate, in CPU time, in one run.

`estimate` runs by turns with every check and with none, on epochs of 20 s: of a virtual session
with the perturbation recorded (`iv`), of the same without it (`bandlimited`), and of a measured
ankle where `RIGIDIMETER_SHARED` names the folder of the recordings. With `--parts` each check is
timed too; what several checks share is with the first of them.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks.checks_cost
    python -m benchmarks.checks_cost --epochs 12 --parts
"""

from __future__ import annotations

import argparse
import contextlib
import os
import time
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from unittest import mock

from benchmarks.paired import REPEATS, Row, in_ms, paired
from rigidimeter.analysis.estimation.diagnostics import CHECKS, Check
from rigidimeter.analysis.estimation.diagnostics.together import Together
from rigidimeter.analysis.reading import ReadOptions, read_recording
from rigidimeter.analysis.study import analysis
from rigidimeter.core.records import Epoch, Fit
from rigidimeter.core.settings import parse_settings
from rigidimeter.virtual.batch import simulate_epochs

VOLUNTARY = {"subject": {"OFF": {"voluntary_sd_nm": 0.1}}}
ANKLE = ReadOptions(
    columns={"angle_rad": "position_rad", "torque_nm": "torque_Nm"},
    reaction=True,
    epoch_length_s=20.0,
)
OUTSIDE = ("checked", "checked_together", "between_epochs")
"""What `analysis.study.analysis` calls beside the estimate."""


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

    def fit_alone(_: object, fit: object, *_other: object, **__: object) -> object:
        return fit

    def fits_alone(_: object, fits: list[Fit], pooled: list[Fit], *__: object) -> Together:
        return Together(fits, pooled, [])

    with contextlib.ExitStack() as stack:
        for name, stub in zip(OUTSIDE, (fit_alone, fits_alone, lambda *_: None), strict=True):
            stack.enter_context(mock.patch.object(analysis, name, stub))
        yield


def rows(count: int = 6, repeats: int = REPEATS) -> list[Row]:
    """Return what an epoch costs with every check and with none."""
    return [
        _row(f"estimate of an epoch of 20 s with every check, {name} / without", epochs, repeats)
        for name, epochs in inputs(count).items()
    ]


def _row(name: str, epochs: Sequence[Epoch], repeats: int) -> Row:
    def alone() -> None:
        with no_checks():
            analysis.estimate(epochs)

    times_s = paired(lambda: analysis.estimate(epochs), alone, repeats, clock=time.process_time)
    return in_ms(name, (times_s[0] / len(epochs), times_s[1] / len(epochs)))


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
    parser.add_argument("--repeats", type=int, default=REPEATS)
    parser.add_argument("--parts", action="store_true", help="time each check too")
    options = parser.parse_args(arguments)
    print("| what / reference | ours | reference | ratio |")
    print("| --- | ---: | ---: | ---: |")
    for row in rows(options.epochs, options.repeats):
        print(row)
    if options.parts:
        tables = {name: parts_ms(epochs) for name, epochs in inputs(options.epochs).items()}
        print(f"\n| check, ms an epoch | {' | '.join(tables)} |")
        print(f"| --- | {' | '.join('---:' for _ in tables)} |")
        for check in dict.fromkeys(part for table in tables.values() for part in table):
            print(f"| {check} | {' | '.join(f'{t.get(check, 0):.1f}' for t in tables.values())} |")


if __name__ == "__main__":
    main()
