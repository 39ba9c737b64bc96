"""The torque perturbation: a maximal-length pseudo-random binary sequence (Sec. 2.4.3).

A shift register of n bits with a primitive feedback polynomial runs through all its 2ⁿ − 1 nonzero
states before it repeats. Its output, held for one clock period a chip and mapped to ±1, has a mean
of 1/(2ⁿ − 1) and an autocorrelation that is 1 at no lag and −1/(2ⁿ − 1) at every other: as near to
white as two levels can be.

References
----------
S. W. Golomb, "Shift Register Sequences", Holden-Day, 1967: the run, balance and correlation
properties. The register itself is `scipy.signal.max_len_seq`.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.errors import UserError
from rigidimeter.experiment.tick_count import as_written, tick_count
from rigidimeter.settings import PrbsSettings

__all__ = ["chip_count", "period_s", "prbs_levels", "prbs_nm"]


def chip_count(settings: PrbsSettings) -> int:
    """Return the chips in one period, 2ⁿ − 1."""
    return (1 << settings.register_bits) - 1


def period_s(settings: PrbsSettings) -> float:
    """Return the time after which the sequence repeats, (2ⁿ − 1) / f_clock, in seconds."""
    return chip_count(settings) / settings.clock_hz


def prbs_levels(register_bits: int) -> NDArray[np.float64]:
    """Return one period of the sequence as levels of ±1, one a chip.

    The register starts from all ones, so that the same number of bits always gives the same
    sequence: the paper used one sequence in every epoch and condition.

    Parameters
    ----------
    register_bits : int
        n, from 2 to 32.

    Returns
    -------
    array, shape (2**n - 1,)
        With one more +1 than −1.

    Raises
    ------
    ValueError
        If scipy knows no primitive polynomial of that degree.
    """
    bits, _ = scipy.signal.max_len_seq(register_bits, state=np.ones(register_bits, dtype=np.int8))
    return 2.0 * bits.astype(np.float64) - 1.0


def prbs_nm(settings: PrbsSettings, rate_hz: float) -> NDArray[np.float64]:
    """Return the torque perturbation of one epoch, one value a tick.

    Chip k starts at the first tick that is not before k / f_clock, counted in whole numbers; the
    sequence repeats or is cut to fill the duration. What remains of a mean over the duration is
    taken off, so that the perturbation does not push the arm to one side; the two levels stay
    2 × amplitude apart.

    Parameters
    ----------
    settings : PrbsSettings
        Bits, clock, amplitude and duration.
    rate_hz : float
        Ticks a second; at least the clock.

    Returns
    -------
    array, shape (duration_s * rate_hz,)
        M_PRBS of Eq. 5, in N·m. Zero mean.

    Raises
    ------
    ValueError
        If the rate is not greater than zero or is below the clock.
    UserError
        If the duration is over before the sequence first changes level.
    """
    per_chip = as_written(rate_hz, "rate_hz") / as_written(settings.clock_hz, "clock_hz")
    if per_chip < 1:
        raise ValueError(
            f"a clock of {settings.clock_hz:g} Hz needs at least as many ticks a second, "
            f"got {rate_hz:g} Hz"
        )
    ticks = tick_count(settings.duration_s, rate_hz)
    up, down = per_chip.numerator, per_chip.denominator
    chips = -(-ticks * down // up)
    starts = np.array([-(-chip * up // down) for chip in range(chips)] + [ticks])
    levels = np.resize(prbs_levels(settings.register_bits), chips)
    signs = np.repeat(levels, np.diff(starts))

    high = int(np.count_nonzero(signs > 0))
    if high in (0, ticks):
        first_change = int(np.argmax(np.diff(prbs_levels(settings.register_bits)) != 0)) + 1
        raise UserError(
            f"prbs.duration_s = {settings.duration_s:g} s ends before the sequence first changes "
            f"level, after {first_change} chips of prbs.clock_hz = {settings.clock_hz:g} Hz "
            f"({first_change / settings.clock_hz:g} s): make it longer or the clock faster"
        )
    # amplitude·(±1 − mean), written so that the two levels cancel over the epoch
    top = 2.0 * settings.amplitude_nm * ((ticks - high) / ticks)
    bottom = -2.0 * settings.amplitude_nm * (high / ticks)
    return np.where(signs > 0, top, bottom)
