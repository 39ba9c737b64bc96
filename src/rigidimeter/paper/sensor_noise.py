"""The simulations of Sec. 3.4: what sensor noise alone does to J, B and K.

White noise of the torque gives standard errors in a ratio that the motion sets and the size of the
noise does not: the Cramér–Rao bound.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from rigidimeter.estimation import fit_epochs
from rigidimeter.experiment import prbs_nm, predicted_precision
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import AGREES, DIFFERS, Row, bounded, within_percent
from rigidimeter.paper.context import Workshop
from rigidimeter.paper.truth import TRUTH, Array, fitted, signed, unbiased
from rigidimeter.reporting.numbers import number
from rigidimeter.settings import parse_settings
from rigidimeter.virtual.batch import simulate_epochs
from rigidimeter.virtual.paper_rates import PAPER_RATES

__all__ = ["ROWS", "NoiseRuns", "noise_runs"]

UNBIASED_PERCENT = 1.0
"""What counts as no bias over the runs."""

SAME_RATIO_PERCENT = 50.0
"""How far the ratio of two printed SDs may be from the ratio that white noise gives."""


FAR_BELOW = 0.1
"""Noise below this share of the sensor's resolution is none that it could show."""


class NoiseRuns(NamedTuple):
    """What sensor noise alone does, in the units of J, B and K; arrays of shape (3,).

    `bound` is the Cramér–Rao bound, `noise_sd_nm` and
    `resolution_nm` those of a torque sample, at `rate_hz`.
    """

    mean: Array
    sd: Array
    bound: Array
    noise_sd_nm: float
    resolution_nm: float
    rate_hz: float


@lru_cache(maxsize=4)
def _noise_runs(seed: int, runs: int) -> NoiseRuns:
    settings = parse_settings({"seed": seed, "rig": dict(PAPER_RATES)}, source="Sec. 3.4")
    subject = settings.subject["OFF"]
    batch = simulate_epochs(settings, runs, joints=[printed.SEC_34] * runs, conditions="OFF")
    fits, _ = fit_epochs([batch.epoch(i) for i in range(runs)], "iv", settings)
    values = np.array([fitted(fit) for fit in fits])
    errors = values - TRUTH
    perturbation = prbs_nm(settings.prbs, settings.rig.tick_rate_hz)
    precision = predicted_precision(perturbation, settings, subject)
    return NoiseRuns(
        errors.mean(axis=0),
        errors.std(axis=0, ddof=1),
        np.array(precision.bound.free),
        settings.rig.torque.noise_sd_nm,
        settings.rig.torque.resolution_nm,
        settings.rig.torque.rate_hz,
    )


def noise_runs(workshop: Workshop) -> NoiseRuns:
    """Return the simulations of Sec. 3.4: closed loop, white sensor noise, one joint."""
    return _noise_runs(workshop.seed, workshop.runs)


def mean_errors(workshop: Workshop) -> Row:
    """Make the row: the mean errors of the simulations."""
    found = noise_runs(workshop)
    percent = 100.0 * found.mean / TRUTH
    return Row(
        id="sec-3.4-mean",
        source="Sec. 3.4",
        paper=f"mean errors of 100 runs {_numbers(np.array(printed.SEC_34_MEAN))}: next to none",
        ours=f"{workshop.runs} runs: {_numbers(found.mean)}, that is "
        f"{', '.join(signed(float(p), 3) for p in percent)} % of J, B, K",
        reading=f"Closed loop at the paper's rates, sensor noise {found.noise_sd_nm:g} N·m, "
        "estimated by instrumental variables.",
        checks=unbiased(
            (float(percent[0]), float(percent[1]), float(percent[2])), UNBIASED_PERCENT
        ),
        because={AGREES: "Sensor noise alone biases neither theirs nor ours."},
    )


def spread_of_errors(workshop: Workshop) -> Row:
    """Make the row: the standard deviations against the Cramér–Rao bound."""
    found = noise_runs(workshop)
    theirs = np.array(printed.SEC_34_SD)
    ratio, wanted = theirs / theirs[2], found.bound / found.bound[2]
    efficiency = found.sd / found.bound
    return Row(
        id="sec-3.4-sd",
        source="Sec. 3.4",
        paper="SD of the errors of J, B, K 9.6e-7, 1.05e-6, 1.4e-6, that is "
        + " : ".join(f"{value:.2f}" for value in ratio),
        ours=f"{_numbers(found.sd)} ({workshop.runs} runs), "
        + " : ".join(f"{number(float(v), 2)}" for v in found.sd / found.sd[2])
        + "; Cramér–Rao "
        + " : ".join(f"{number(float(v), 2)}" for v in wanted)
        + f"; ours over the bound {', '.join(f'{v:.2f}' for v in efficiency)}",
        reading="We report ours against the Cramér–Rao bound.",
        checks=(
            within_percent("SD(J)/SD(K)", "", float(ratio[0]), float(wanted[0]),
                           SAME_RATIO_PERCENT),
            within_percent("SD(B)/SD(K)", "", float(ratio[1]), float(wanted[1]),
                           SAME_RATIO_PERCENT),
        ),
        because={DIFFERS: "The ratio of the three SDs is set by the motion, not by the size of the "
                 "noise; no white torque noise gives the printed one."},
    )  # fmt: skip


def implied_noise(workshop: Workshop) -> Row:
    """Make the row: the noise that the printed SD of K would need."""
    found = noise_runs(workshop)
    implied_nm = found.noise_sd_nm * printed.SEC_34_SD[2] / float(found.bound[2])
    return Row(
        id="sec-3.4-noise",
        source="Sec. 3.4, Sec. 2.6",
        paper="noise as of the torque transducer at rest",
        ours=f"the printed SD of K needs a noise of {number(implied_nm, 2)} N·m at "
        f"{found.rate_hz:g} samples/s",
        reading=f"A resolution of {found.resolution_nm:g} N·m, the finest of such a transducer; "
        "the paper gives none.",
        checks=(
            bounded("Implied noise", "N·m", implied_nm, low=FAR_BELOW * found.resolution_nm),
        ),
        because={DIFFERS: f"That is 1/{found.resolution_nm / implied_nm:.0f} of the sensor's "
                 f"resolution and 1/{found.noise_sd_nm / implied_nm:.0f} of a noise of "
                 f"{found.noise_sd_nm:g} N·m, which such a sensor has."},
    )  # fmt: skip


def _numbers(values: Array) -> str:
    return ", ".join(number(float(value), 2) for value in values)


ROWS: Mapping[str, Callable[[Workshop], Row]] = {
    "sec-3.4-mean": mean_errors,
    "sec-3.4-sd": spread_of_errors,
    "sec-3.4-noise": implied_noise,
}
