"""Thousands of recordings to one table, against the estimator alone: time and memory.

An archive of small files, each of four epochs of 6 s at 100 samples/s, by least squares: about the
cheapest epochs there are, so what the batch adds to each shows most. Every run is a process of its
own. Times are by the clock and by the processor: the latter also count on a busy machine. The
speed-up by the processor is that of two processors with nothing else to do: the processor time of
one worker over half of that of the command and its two workers together.

    python -m benchmarks.archive                      # 10,000 epochs: some minutes
    python -m benchmarks.archive --epochs 2000
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np
from tests.known_joint import angle_rad, torque_nm

import rigidimeter as rm
from benchmarks.paired import Row
from rigidimeter.cli.progress import Meter

EPOCHS_A_FILE = 4
RATE_HZ, LENGTH_S = 100.0, 6.0
FEW = 1_000
JOINTS = 10

Measured = dict[str, float]


def write_archive(folder: Path, files: int) -> None:
    """Write files that differ in their noise."""
    per_epoch = round(RATE_HZ * LENGTH_S)
    time_s = np.arange(per_epoch * EPOCHS_A_FILE) / RATE_HZ
    epoch = np.repeat(np.arange(EPOCHS_A_FILE), per_epoch)
    exact = [(torque_nm(time_s, seed, 0.0), angle_rad(time_s, seed)) for seed in range(JOINTS)]
    for number in range(files):
        torque, angle = exact[number % JOINTS]
        noise = 0.002 * np.random.default_rng(number).normal(size=time_s.size)
        np.savez(
            folder / f"{number:05d}.npz",
            time_s=time_s,
            torque_nm=torque + noise,
            angle_rad=angle,
            epoch=epoch,
        )


def measured(folder: Path, files: int, jobs: int) -> Measured:
    """Estimate the first files of an archive in this process, or by a batch with so many jobs."""
    paths = sorted(folder.glob("*.npz"))[:files]
    rm.estimate(rm.read(paths[0]))  # imports are made and caches are full
    with tempfile.TemporaryDirectory() as name:
        meter = Meter("batch", 1.0, from_first=True)
        used_s, start_s = time.process_time(), time.perf_counter()
        told: list[tuple[float, float]] = []  # when, and the time left then

        def progress(share: float) -> None:
            meter.reach(share)
            if meter.left_s is not None:
                told.append((time.perf_counter() - start_s, meter.left_s))

        if jobs:
            done = rm.batch(paths, Path(name) / "out.parquet", jobs=jobs, progress=progress)
            assert (done.epochs, done.failed) == (files * EPOCHS_A_FILE, ())
        else:
            for path in paths:
                rm.estimate(rm.read(path))
        elapsed_s = time.perf_counter() - start_s
        used_s = time.process_time() - used_s
    own, workers = map(resource.getrusage, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return {
        "epochs": files * EPOCHS_A_FILE,
        "s": elapsed_s,
        "processor_s": used_s,
        "workers_s": workers.ru_utime + workers.ru_stime,
        "mb": own.ru_maxrss / 1024,
        "worker_mb": workers.ru_maxrss / 1024,
        "told_s": told[0][1] if told else 0.0,
        "left_s": elapsed_s - told[0][0] if told else 0.0,
    }


def apart(folder: Path, files: int, jobs: int) -> Measured:
    """Measure in a process of its own, which computes with one thread, as the command line does."""
    command = [
        sys.executable,
        "-m",
        "benchmarks.archive",
        "--run",
        str(folder),
        str(files),
        str(jobs),
    ]
    one_thread = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    ran = subprocess.run(command, check=True, capture_output=True, text=True, env=one_thread)
    return dict(json.loads(ran.stdout))


class Rates(NamedTuple):
    """The ms that an epoch takes: by the clock, and of all processors."""

    clock_ms: float
    processor_ms: float


def rates(run: Measured) -> Rates:
    seconds = run["s"], run["processor_s"] + run["workers_s"]
    return Rates(*(1e3 * each / run["epochs"] for each in seconds))


def rows(folder: Path, epochs: int) -> list[Row]:
    """Return what was measured."""
    few = min(FEW, epochs) // EPOCHS_A_FILE
    runs = {
        "alone": apart(folder, few, 0),
        "one": apart(folder, few, 1),
        "small": apart(folder, few, 2),
        "large": apart(folder, epochs // EPOCHS_A_FILE, 2),
    }
    print(json.dumps(runs, indent=1), file=sys.stderr)
    alone, one, two = (rates(runs[name]) for name in ("alone", "one", "large"))
    small, large = runs["small"], runs["large"]
    found = []
    for by, k in (("clock", 0), ("processor", 1)):
        shared = two[k] if k else 2 * two[k]
        found += [
            Row(f"archive, by the {by}, an epoch by estimate / by batch", alone[k], one[k]),
            Row(f"archive, by the {by}, an epoch by estimate / of one of two workers",
                alone[k], shared),
            Row(f"archive, by the {by}, an epoch with one worker / with two", one[k], shared / 2),
        ]  # fmt: skip
    sizes = f"of {large['epochs']:.0f} epochs / of {small['epochs']:.0f}"
    return [
        *found,
        Row(
            "archive, time left as shown after a tenth of the work / as it was",
            large["told_s"],
            large["left_s"],
            "s",
        ),
        Row(f"archive, peak memory {sizes}", large["mb"], small["mb"], "MB"),
        Row(
            f"archive, peak memory of a worker {sizes}",
            large["worker_mb"],
            small["worker_mb"],
            "MB",
        ),
    ]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--epochs", type=int, default=10_000)
    parser.add_argument("--run", nargs=3, metavar=("FOLDER", "FILES", "JOBS"), help="one run alone")
    chosen = parser.parse_args()
    if chosen.run:
        folder, files, jobs = chosen.run
        print(json.dumps(measured(Path(folder), int(files), int(jobs))))
        return
    with tempfile.TemporaryDirectory() as name:
        write_archive(Path(name), chosen.epochs // EPOCHS_A_FILE)
        for row in rows(Path(name), chosen.epochs):
            print(row)


if __name__ == "__main__":
    main()
