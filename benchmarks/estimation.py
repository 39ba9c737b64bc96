"""Estimation of an epoch from its channels."""

from __future__ import annotations

from functools import partial

import numpy as np

from benchmarks.paired import REPEATS, Row, in_ms, paired
from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.core.settings import Settings
from rigidimeter.virtual.batch import simulate_epochs


def rows(repeats: int = REPEATS) -> list[Row]:
    """Return what was measured of one epoch."""
    settings = Settings()
    epoch = simulate_epochs(settings, 1).epoch(0)
    rng = np.random.default_rng(0)
    n = len(epoch.channels["torque_nm"])
    A, b = rng.standard_normal((n, 3)), rng.standard_normal(n)

    def bare() -> None:
        np.linalg.lstsq(A, b, rcond=None)

    found = []
    for name in ("iv", "bandlimited", "published"):
        times_s = paired(partial(fit_epoch, epoch, name, settings), bare, repeats)
        what = f"{name} with intervals, an epoch of 20 s at 1 kHz"
        found.append(in_ms(f"{what} / numpy.linalg.lstsq on {n} × 3", times_s))
    return found
