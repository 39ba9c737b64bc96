"""Bias and coverage of single epochs on the virtual rig and on one that shares nothing with it.

The other is `tests.scenarios.independent_rig`: a drive that its load slows down, another controller
and perturbation, voluntary torque with soft skirts, tremor that drifts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from tests.scenarios.independent_rig import Rig, simulate

from benchmarks.known_joint import JOINT, TRUTH, array
from rigidimeter.analysis.estimation import estimate_recorded, prepare
from rigidimeter.core.records import Channel, Epoch, Fit
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.virtual.batch import simulate_chunks

SESSION = 4
"""Epochs that are analysed together."""

SUBJECTS: Mapping[str, tuple[float, float]] = {
    "relaxed": (0.0, 0.0),
    "voluntary torque 0.2 N·m": (0.2, 0.0),
    "tremor 0.3 N·m": (0.0, 0.3),
}
"""SD of the voluntary torque and amplitude of the tremor, in N·m."""

HEADER = ["rig, subject, method", "bias J B K (%)", "SD (%)", "coverage (%)", "SE / SD"]


def rows(n: int) -> Iterator[list[str]]:
    """Yield a row for each rig, subject and method, of n epochs."""
    for rig, sessions, truth in (
        ("virtual", _virtual, TRUTH),
        ("independent", _independent, np.array(Rig().joint)),
    ):
        for subject, (voluntary_nm, tremor_nm) in SUBJECTS.items():
            fits: dict[str, list[Fit]] = {"iv": [], "torque and angle alone": []}
            for epochs, settings in sessions(n, voluntary_nm, tremor_nm):
                fits["iv"] += _fits(epochs, "iv", settings)
                alone = [measured_alone(epoch) for epoch in epochs]
                fits["torque and angle alone"] += _fits(alone, "bandlimited", settings)
            for method, found in fits.items():
                yield [f"{rig}, {subject}, {method}", *_cells(found, truth)]


def measured_alone(epoch: Epoch) -> Epoch:
    """Return the epoch as a file of torque and angle holds it."""
    channels = {name: epoch.channels[name] for name in ("torque_nm", "angle_rad")}
    return Epoch(epoch.source, epoch.label, channels, epoch.condition, epoch.task)


def _fits(epochs: list[Epoch], method: str, settings: Settings) -> list[Fit]:
    analysis = estimate_recorded(prepare(epochs, settings), method, fits_alone=True)
    return [fit for fit in analysis.fits if fit.n_samples]


def _cells(fits: list[Fit], truth: np.ndarray) -> list[str]:
    values, se = array(fits), array(fits, "_se")
    covered = (array(fits, "_low") <= truth) & (array(fits, "_high") >= truth)
    bias, spread = values.mean(0) / truth - 1, values.std(0, ddof=1)
    return [
        " ".join(f"{100 * x:+.2f}" for x in bias),
        " ".join(f"{100 * x:.2g}" for x in spread / truth),
        " ".join(f"{100 * x:.1f}" for x in covered.mean(0)),
        " ".join(f"{x:.2f}" for x in np.median(se, 0) / spread),
    ]


def _virtual(
    n: int, voluntary_nm: float, tremor_nm: float
) -> Iterator[tuple[list[Epoch], Settings]]:
    subject = {"voluntary_sd_nm": voluntary_nm, "tremor_amplitude_nm": tremor_nm}
    settings = parse_settings({"subject": {"OFF": subject}})
    for batch in simulate_chunks(
        settings, n, chunk=SESSION, joints=[JOINT] * n, conditions="OFF", seed=43
    ):
        yield [batch.epoch(i) for i in range(len(batch))], settings


def _independent(
    n: int, voluntary_nm: float, tremor_nm: float
) -> Iterator[tuple[list[Epoch], Settings]]:
    rig = Rig(voluntary_nm=voluntary_nm, tremor_nm=tremor_nm)
    settings = parse_settings(rig.settings())
    recorded = simulate(rig, n, 43)
    for first in range(0, n, SESSION):
        numbers = range(first, min(first + SESSION, n))
        yield [_epoch(first, k, recorded.epoch(k)) for k in numbers], settings


def _epoch(session: int, number: int, arrays: Mapping[str, Any]) -> Epoch:
    stamps = arrays["time_s"]
    channels = {
        name: Channel(name, stamps, values) for name, values in arrays.items() if name != "time_s"
    }
    return Epoch(str(session), str(number), channels, "OFF", "prbs", virtual=True)
