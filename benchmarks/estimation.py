"""Estimation: one epoch from raw channels, and thousands in memory that stays flat."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable

import numpy as np

from benchmarks.paired import Row, in_ms, paired
from rigidimeter.estimation import fit_epoch, fit_epochs
from rigidimeter.estimation.closedloop.epoch_stream import EpochStream
from rigidimeter.settings import Settings
from rigidimeter.virtual.batch import simulate_chunks, simulate_epochs


def rows() -> list[Row]:
    """Return what was measured."""
    return [*_one_epoch(), *_many_epochs()]


def _one_epoch() -> list[Row]:
    settings = Settings()
    batch = simulate_epochs(settings, 12)
    epochs = [batch.epoch(i) for i in range(len(batch))]
    stream = EpochStream(epochs, settings)
    rng = np.random.default_rng(0)
    n = len(epochs[0].channels["torque_nm"])
    A, b = rng.standard_normal((n, 3)), rng.standard_normal(n)

    def bare() -> None:
        np.linalg.lstsq(A, b, rcond=None)

    works: dict[str, tuple[Callable[[], object], float]] = {
        "point estimate of a 20 s epoch at 1 kHz from raw channels, iv": (
            lambda: stream.estimate(epochs[:1]),
            1.0,
        ),
        "the same, of twelve at once, each": (lambda: stream.estimate(epochs), 12.0),
        "iv with intervals, twelve epochs fitted together, each": (
            lambda: fit_epochs(epochs, "iv", settings),
            12.0,
        ),
        "bandlimited with intervals": (
            lambda: fit_epoch(epochs[0], "bandlimited", settings),
            1.0,
        ),
        "published with intervals": (
            lambda: fit_epoch(epochs[0], "published", settings),
            1.0,
        ),
    }
    found = []
    for name, (work, share) in works.items():
        ours, reference = paired(work, bare)
        found.append(in_ms(f"{name} / numpy.linalg.lstsq on {n} × 3", (ours / share, reference)))
    return found


_MANY = """
import resource, sys, time
from benchmarks.estimation import stream_of
stream_of(12)  # compile, or load what was compiled
start = time.perf_counter()
stream_of(int(sys.argv[1]))
peak_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(time.perf_counter() - start, peak_kb)
"""


def stream_of(n_epochs: int) -> EpochStream:
    """Simulate and estimate so many epochs of 20 s at 1 kHz, a chunk at a time."""
    settings = Settings()
    stream: EpochStream | None = None
    for batch in simulate_chunks(settings, n_epochs, workers=2):
        epochs = [batch.epoch(i) for i in range(len(batch))]
        stream = stream or EpochStream(epochs, settings)
        stream.estimate(epochs)
    assert stream is not None
    return stream


def _many_epochs() -> list[Row]:
    took, peak = {}, {}
    for n_epochs in (100, 10_000):
        ran = subprocess.run(
            [sys.executable, "-c", _MANY, str(n_epochs)], check=True, capture_output=True, text=True
        )
        seconds, kilobytes = map(float, ran.stdout.split())
        took[n_epochs], peak[n_epochs] = seconds / n_epochs, kilobytes / 1024
    return [
        in_ms(
            "simulate and estimate, time per epoch of 10,000 / of 100 epochs",
            (took[10_000], took[100]),
        ),
        Row("peak memory of that, 10,000 / 100 epochs", peak[10_000], peak[100], "MB"),
    ]
