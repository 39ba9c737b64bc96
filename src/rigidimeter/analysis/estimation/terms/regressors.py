"""The regressors of a sum of terms: everything linear is done once.

The band F and the dynamics H of a reflex are both linear, so F comes first, on the wide-band rate,
and H, which the search changes, on the few samples that are kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.analysis.estimation.terms.reflex import (
    Kernel,
    kernel,
    pass_through,
    stretch_velocity,
)
from rigidimeter.analysis.estimation.terms.separable import search
from rigidimeter.analysis.estimation.terms.wideband import banded

SAMPLES_PER_CYCLE = 2.5
"""Of the highest frequency of the band, kept for the fit."""


class Design:
    """Everything linear done once: banded, thinned regressors and stretches."""

    def __init__(
        self, motion: Signals, terms: Sequence[str], band_hz: tuple[float, float], trim_s: float
    ) -> None:
        step = max(1, int(motion.rate_hz / (SAMPLES_PER_CYCLE * band_hz[1]) + 1e-6))

        def thin(values: Array) -> Array:
            return banded(values, motion.rate_hz, band_hz)[::step]

        self.rate_hz = motion.rate_hz / step
        self.terms = tuple(terms)
        self.torque_nm = thin(motion.torque_nm)
        self.velocity_rad_s = thin(motion.velocity_rad_s)
        trim = round(trim_s * self.rate_hz)
        self.keep = slice(trim, self.torque_nm.size - trim)
        if self.torque_nm[self.keep].size < 2:
            raise ValueError(
                f"it lasts {motion.time_s.size / motion.rate_hz:.3g} s, of which {trim_s:g} s are "
                "trimmed at each end"
            )
        self.plain = {
            name: thin(term.regressor(motion))[self.keep]
            for name in terms
            if (term := term_named(name)) is not None
        }
        self.kernels: dict[str, Kernel] = {name: kernel(name) for name in terms if name in REFLEXES}
        self.stretches = {name: thin(stretch_velocity(motion, name)) for name in self.kernels}

    @property
    def names(self) -> list[str]:
        """The linear parameters, one for each column."""
        names: list[str] = []
        for term in self.terms:
            columns = self.kernels[term].columns if term in self.kernels else ("",)
            names += [f"{term} {column}".strip() for column in columns]
        return names

    def columns(self, nonlinear: Array) -> Array:
        """Return A(q), shape (n, p)."""
        columns: list[Array] = []
        used = 0
        for term in self.terms:
            if term not in self.kernels:
                columns.append(self.plain[term])
                continue
            count = len(self.kernels[term].nonlinear)
            own = nonlinear[used : used + count]
            used += count
            passed = pass_through(self.stretches[term], self.rate_hz, self.kernels[term], own)
            columns += [column[self.keep] for column in passed]
        return np.column_stack(columns)

    def search(self) -> Array:
        """Return the q of least residual."""
        kernels = list(self.kernels.values())
        starts = [sum(parts, ()) for parts in product(*(one.starts for one in kernels))]
        low = [bound for one in kernels for bound in one.low]
        high = [bound for one in kernels for bound in one.high]
        return search(self.columns, self.torque_nm[self.keep], starts, low, high)
