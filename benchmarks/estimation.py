"""Estimation of an epoch from its channels."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.paired import REPEATS, Row, in_ms, paired
from rigidimeter.analysis.estimation import fit_epoch, fit_epochs
from rigidimeter.core.settings import Settings
from rigidimeter.virtual.batch import simulate_epochs


def rows(count: int = 12, repeats: int = REPEATS) -> list[Row]:
    """Return what was measured; so many epochs are fitted together."""
    settings = Settings()
    batch = simulate_epochs(settings, count)
    epochs = [batch.epoch(i) for i in range(len(batch))]
    rng = np.random.default_rng(0)
    n = len(epochs[0].channels["torque_nm"])
    A, b = rng.standard_normal((n, 3)), rng.standard_normal(n)

    def bare() -> None:
        np.linalg.lstsq(A, b, rcond=None)

    works: dict[str, tuple[Callable[[], object], int]] = {
        f"iv with intervals, {count} epochs of 20 s at 1 kHz fitted together, each": (
            lambda: fit_epochs(epochs, "iv", settings),
            count,
        ),
        "bandlimited with intervals": (
            lambda: fit_epoch(epochs[0], "bandlimited", settings),
            1,
        ),
        "published with intervals": (
            lambda: fit_epoch(epochs[0], "published", settings),
            1,
        ),
    }
    found = []
    for name, (work, share) in works.items():
        ours, reference = paired(work, bare, repeats)
        found.append(in_ms(f"{name} / numpy.linalg.lstsq on {n} × 3", (ours / share, reference)))
    return found
