"""What reading a file costs beside its library: CPU and memory, in one run.

    python -m benchmarks.reading                 two minutes, on Linux
    python -m benchmarks.reading --rows 200000

Each way is timed in a process of its own, which has read a small file before; the ways take turns.
The gate has its columns in memory: choosing, judging and cutting alone.
"""

from __future__ import annotations

import argparse
import json
import re
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import signal

import rigidimeter as rm
from rigidimeter.analysis.reading_anew import (
    Column,
    Columns,
    Mapping,
    columns_of,
    read_file,
    recording_of,
    verdict,
)

RATE_HZ, ROWS, REPEATS = 1000.0, 1_400_000, 3
FORMATS = ("csv", "npz", "mat", "h5", "parquet")
WAYS = ("library", "in use", "anew", "gate")
NAMES = ("time_s", "torque_nm", "angle_rad")


def recording(n_rows: int) -> dict[str, np.ndarray]:
    """Return a joint of J 0.005, B 0.14, K 1.75 pushed by a random binary torque."""
    rng = np.random.default_rng(1)
    torque = np.repeat(rng.choice([-0.4, 0.4], n_rows // 50 + 1), 50)[:n_rows]
    numerator, denominator, _ = signal.cont2discrete(([1.0], [0.005, 0.14, 1.75]), 1 / RATE_HZ)
    angle = signal.lfilter(np.ravel(numerator), denominator, torque)
    noisy = torque + 0.01 * rng.standard_normal(n_rows)
    return dict(zip(NAMES, (np.arange(n_rows) / RATE_HZ, noisy, angle), strict=True))


def write(path: Path, columns: dict[str, np.ndarray]) -> None:
    """Write columns in the format of a suffix."""
    import h5py
    import pandas as pd
    import scipy.io

    if path.suffix == ".csv":
        pd.DataFrame(columns).to_csv(path, index=False, float_format="%.9g")
    elif path.suffix == ".npz":
        np.savez(path, **columns)
    elif path.suffix == ".mat":
        scipy.io.savemat(path, columns)
    elif path.suffix == ".parquet":
        pd.DataFrame(columns).to_parquet(path)
    else:
        with h5py.File(path, "w") as file:
            for name, values in columns.items():
                file[name] = values


def by_library(path: Path) -> object:
    """Read all columns as a user of the library does."""
    import h5py
    import pandas as pd
    import scipy.io

    if path.suffix == ".csv":
        return pd.read_csv(path)
    if path.suffix == ".npz":
        with np.load(path) as archive:
            return [archive[name] for name in archive.files]
    if path.suffix == ".mat":
        return scipy.io.loadmat(path)
    if path.suffix == ".parquet":
        return pd.read_parquet(path)
    with h5py.File(path) as file:
        return [file[name][()] for name in file]


def in_memory(path: Path) -> Callable[[Path], object]:
    """Return the gate on the columns of a file."""
    found = columns_of(path, Mapping())
    held = {name: Column.of(one.read()) for name, one in found.columns.items()}
    file = Columns(found.source, held)
    return lambda _: recording_of(file, verdict(file, Mapping()))


def timed(path: Path, small: Path, way: str) -> dict[str, float]:
    """Return CPU in s (median) and the peak memory in MB beyond what the process had."""
    ways: dict[str, Callable[[Path], object]] = {
        "library": by_library,
        "in use": rm.read,
        "anew": read_file,
    }
    function = ways.get(way) or in_memory(path)
    function(small)
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before_mb = resident_mb("VmRSS")
    taken = []
    for _ in range(REPEATS):
        start = time.process_time()
        function(path)
        taken.append(time.process_time() - start)
    peak_mb = resident_mb("VmHWM") - before_mb
    return {"cpu_s": statistics.median(taken), "peak_mb": peak_mb}


def resident_mb(what: str) -> float:
    """Return the memory of this process, now (VmRSS) or at most (VmHWM); of Linux."""
    found = re.search(rf"{what}:\s+(\d+) kB", Path("/proc/self/status").read_text("utf-8"))
    return int(found[1]) / 1024 if found else float("nan")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rows", type=int, default=ROWS)
    parser.add_argument("--one", nargs=3, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.one:
        path, small, way = given.one
        print(json.dumps(timed(Path(path), Path(small), way)))
        return
    channels_mb = given.rows * 8 * len(NAMES) / 2**20
    print(f"{given.rows} rows; the channels and their time have {channels_mb:.0f} MB")
    print(f"{'':8}" + "".join(f"{way:>26}" for way in WAYS))
    with tempfile.TemporaryDirectory() as folder:
        for kind in FORMATS:
            path, small = (Path(folder) / f"{name}.{kind}" for name in ("large", "small"))
            write(path, recording(given.rows))
            write(small, recording(20_000))
            cells = []
            for way in WAYS:
                command = [sys.executable, "-m", "benchmarks.reading", "--one", path, small, way]
                ran = subprocess.run(list(map(str, command)), capture_output=True, check=True)
                found = json.loads(ran.stdout)
                per_row = 1e6 * found["cpu_s"] / given.rows
                cells.append(f"{found['cpu_s']:.3f} s {per_row:.3f} us {found['peak_mb']:.0f} MB")
            print(f"{kind:8}" + "".join(f"{cell:>26}" for cell in cells), flush=True)
            path.unlink()


if __name__ == "__main__":
    main()
