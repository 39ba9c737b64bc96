"""Torque in the band of the live estimate, as measured and as its equation foresaw it.

Each sample passes the filters of the live estimate and its equation, in which J, B and K are those
of the samples before it. So what is drawn as modelled was never fitted to the point it is drawn at.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from rigidimeter.core.settings import OnlineSettings
from rigidimeter.rig.acquisition.processes import Estimator


class BandTorque:
    """Follows the samples of a session.

    Parameters
    ----------
    settings : OnlineSettings
    rate_hz : float
        Of the loop.
    """

    def __init__(self, settings: OnlineSettings, rate_hz: float) -> None:
        self._estimator = Estimator(settings, rate_hz)

    @property
    def since_s(self) -> float:
        """When the first sample of the epoch was taken, of which the values are."""
        return self._estimator.since_s

    def take(
        self, rows: NDArray[np.void], missed: int
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return measured and modelled torque of each row in N·m; NaN in a rest.

        Parameters
        ----------
        rows : array of ROW
            Following those of the last call.
        missed : int
            Samples between them; then filters and memory begin anew.
        """
        found = np.full((2, rows.size), np.nan)
        ticks = rows["tick"].tolist()
        place = dict(zip(ticks, range(len(ticks)), strict=True))
        for tick in self._estimator.steps(rows, missed):
            if tick in place:  # and was not left out by the loop
                found[:, place[tick]] = self._estimator.torque()
        return found[0], found[1]
