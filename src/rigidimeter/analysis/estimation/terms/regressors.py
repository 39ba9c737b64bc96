"""The regressors of a sum of terms: everything linear is done once.

The band F and the dynamics H of a reflex are both linear, so F comes first, on the wide-band rate,
and H, which the search changes, on the few samples that are kept. What is linear in the
coefficients c is solved, what is not, q, is searched (variable projection: Golub and Pereyra 1973;
2003 for a review):

    min over q, c of |y − A(q) c|²  =  min over q of |y − A(q) c(q)|²
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, term_named
from rigidimeter.analysis.estimation.terms.reflex import (
    Kernel,
    kernel,
    pass_through,
    points_tried,
    stretch_velocity,
)
from rigidimeter.analysis.estimation.terms.wideband import banded

SAMPLES_PER_CYCLE = 2.5
"""Of the highest frequency of the band, kept for the fit."""

REFINED_STARTS = 3
"""How many of the best points of the grid are refined; the rest have lost by then."""


class Design:
    """Everything linear done once: banded, thinned regressors and stretches."""

    def __init__(
        self, motion: Signals, terms: Sequence[str], band_hz: tuple[float, float], trim_s: float
    ) -> None:
        step = max(1, int(motion.rate_hz / (SAMPLES_PER_CYCLE * band_hz[1]) + 1e-6))

        def thin(values: Array) -> Array:
            return banded(values, motion.rate_hz, band_hz)[::step]

        self.rate_hz = motion.rate_hz / step
        self.terms, self.band_hz, self.trim_s = tuple(terms), band_hz, trim_s
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
        columns = {term: one.columns for term, one in self.kernels.items()}
        each = ((term, columns.get(term, ("",))) for term in self.terms)
        return [f"{term} {column}".strip() for term, of_term in each for column in of_term]

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

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The least and the largest q, shape (k,) each."""
        kernels = self.kernels.values()
        low = [bound for one in kernels for bound in one.low]
        return np.array(low), np.array([bound for one in kernels for bound in one.high])

    def search(self) -> Array:
        """Return the q of least residual: best of a grid, then refined; shape (k,)."""
        low, high = self.bounds
        if not low.size:
            return low
        target = self.torque_nm[self.keep]

        def residual(parameters: Array) -> Array:
            columns = self.columns(parameters)
            lengths = np.linalg.norm(columns, axis=0)
            scaled = columns / np.where(lengths > 0, lengths, 1.0)
            # On the way q may make columns alike; what counts is the distance to their span.
            values, *_ = np.linalg.lstsq(scaled, target, rcond=1e-10)
            return np.asarray(target - scaled @ values, dtype=np.float64)

        starts = [np.clip(start, low, high) for start in points_tried(self.kernels)]
        best = sorted(starts, key=lambda start: float(np.linalg.norm(residual(start))))
        refined = [
            scipy.optimize.least_squares(
                residual,
                start,
                bounds=(low, high),
                x_scale=high - low,
                diff_step=np.full(low.size, 1e-5),
                max_nfev=60,
            )
            for start in best[:REFINED_STARTS]
        ]
        return np.asarray(min(refined, key=lambda found: float(found.cost)).x, dtype=np.float64)
