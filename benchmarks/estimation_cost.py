"""What an estimation costs on rigs that are not the virtual one: CPU, cold start, memory kept.

    OPENBLAS_NUM_THREADS=1 python -m benchmarks.estimation_cost

CPU is of an epoch of 20 s at 1 kHz with every check, in multiples of numpy.linalg.lstsq on
20,000 × 3 beside it. The cold start is the CPU time of a process that reads a
CSV of two such epochs and prints an estimate, in multiples of one that imports numpy and
scipy.signal; both from bytecode. Memory is what a process keeps after so many recordings of one
epoch, each with its own samples, beyond what it has after five.
"""

from __future__ import annotations

import argparse
import contextlib
import gc
import os
import resource
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.late_drive_rig import LateRig, simulate

import rigidimeter as rm
from benchmarks.house import small_csv
from benchmarks.paired import cpu_in_regressions, paired
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import Settings, parse_settings

Made = tuple[Sequence[Epoch], Settings]
FIRST = 5
"""Recordings after which whatever is loaded or made once is there."""


def late(epochs: int) -> Made:
    """Return a recording of a human's joint behind a late drive."""
    rig = LateRig()
    return simulate(rig, 0, epochs), parse_settings(rig.settings())


def of_scenario(name: str, epochs: int = 1) -> Made:
    """Return a recording of a scenario."""
    return SCENARIOS[name].simulated(0, epochs)[0], SCENARIOS[name].analysed_with()


RECORDINGS: dict[str, Callable[[], Made]] = {
    "one epoch": lambda: of_scenario("relaxed"),
    "12 epochs": lambda: of_scenario("relaxed", 12),
    "one epoch, late drive": lambda: late(1),
    "12 epochs, late drive": lambda: late(12),
    "one epoch, friction in the joint": lambda: of_scenario("friction in the joint 0.1 N·m"),
    "one epoch, friction in the drive": lambda: of_scenario("friction in the drive 3 N·m"),
}

COLD = """
import sys
import rigidimeter
print(rigidimeter.estimate(rigidimeter.read(sys.argv[1])).fits[0].value)
"""


def cpu(make: Callable[[], Made], repeats: int) -> float:
    """Return the CPU time of an epoch, in regressions."""
    epochs, settings = make()
    costs = []
    for _ in range(repeats + 1):
        fresh = [replace(epoch) for epoch in epochs]
        costs.append(cpu_in_regressions(lambda e=fresh: rm.estimate(e, settings=settings)))
    # The first loads and compiles.
    return statistics.median(costs[1:]) / len(epochs)


def cold_starts(repeats: int) -> Iterator[tuple[str, float]]:
    """Yield the cold start of Python and of the command, by the import of SciPy."""
    with tempfile.TemporaryDirectory() as folder:
        path = small_csv(Path(folder) / "elbow.csv")
        environment = {
            **os.environ,
            "PYTHONPYCACHEPREFIX": f"{folder}/bytecode",
            "PYTHONDONTWRITEBYTECODE": "",
        }

        def ratio(*words: object) -> float:
            ours, reference = paired(
                lambda: running(*words),
                lambda: running("-c", "import numpy, scipy.signal"),
                repeats,
                of_children_s,
            )
            return ours / reference

        def running(*words: object) -> None:
            command = [sys.executable, *map(str, words)]
            subprocess.run(command, check=True, env=environment, stdout=subprocess.DEVNULL)

        yield "cold start, CSV to a printed estimate", ratio("-c", COLD, path)
        yield "cold start, `rigidimeter estimate CSV`", ratio("-m", "rigidimeter", "estimate", path)


def of_children_s() -> float:
    """Return the CPU time of the processes that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def kept_mb(recordings: int) -> float:
    """Return the memory that this process keeps after so many recordings."""
    (epoch,), settings = late(1)
    torque = epoch.channels["torque_nm"]
    before_mb = 0.0
    for number in range(FIRST + recordings):
        noise = np.random.default_rng(number).normal(0.0, 0.01, len(torque))
        channels = {key: replace(one, values=one.values.copy(), time_s=one.time_s.copy())
                    for key, one in epoch.channels.items()}  # fmt: skip
        channels["torque_nm"] = replace(torque, values=torque.values + noise)
        rm.estimate([replace(epoch, source=f"{number}", channels=channels)], settings=settings)
        if number == FIRST - 1:
            before_mb = resident_mb()
    return resident_mb() - before_mb


def resident_mb() -> float:
    """Return the resident memory of this process after what can be given back was."""
    gc.collect()
    with contextlib.suppress(OSError, AttributeError):
        import ctypes

        ctypes.CDLL(None).malloc_trim(0)
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 1e6


def kept_apart_mb(recordings: int) -> float:
    """Return the same of a process of its own."""
    words = ["-m", "benchmarks.estimation_cost", "--kept", "--memory", str(recordings)]
    ran = subprocess.run([sys.executable, *words], check=True, capture_output=True, text=True)
    return float(ran.stdout)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--memory", type=int, default=100, help="recordings; 0 for no such row")
    parser.add_argument("--only", nargs="+", default=[""], help="words in names of rows")
    parser.add_argument("--kept", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.kept:
        print(kept_mb(options.memory))
        return

    def wanted(name: str) -> bool:
        return any(word in name for word in options.only)

    def say(name: str, value: float) -> None:
        print(f"| {name} | {value:.3g} |", flush=True)

    print("| what | |\n| --- | ---: |")
    for name, make in RECORDINGS.items():
        if wanted(name):
            say(f"CPU of an epoch, {name} (lstsq)", cpu(make, options.repeats))
    if wanted("cold start"):
        for name, ratio in cold_starts(options.repeats):
            say(f"{name} (import of NumPy and SciPy)", ratio)
    if options.memory and wanted("memory"):
        kept = kept_apart_mb(options.memory)
        say(f"memory kept after {options.memory} recordings (MB)", kept)


if __name__ == "__main__":
    main()
