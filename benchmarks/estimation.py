"""Estimation of an epoch from its channels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.paired import Row, in_ms, paired
from rigidimeter.estimation import fit_epoch, fit_epochs
from rigidimeter.settings import Settings
from rigidimeter.virtual.batch import simulate_epochs


def rows() -> list[Row]:
    """Return what was measured."""
    settings = Settings()
    batch = simulate_epochs(settings, 12)
    epochs = [batch.epoch(i) for i in range(len(batch))]
    rng = np.random.default_rng(0)
    n = len(epochs[0].channels["torque_nm"])
    A, b = rng.standard_normal((n, 3)), rng.standard_normal(n)

    def bare() -> None:
        np.linalg.lstsq(A, b, rcond=None)

    works: dict[str, tuple[Callable[[], object], float]] = {
        "iv with intervals, twelve epochs of 20 s at 1 kHz fitted together, each": (
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
