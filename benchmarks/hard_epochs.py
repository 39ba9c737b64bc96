"""Epochs of which a stretch is lost, and epochs whose subject pushes over all of the band."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tests.scenarios.recordings import measured_alone
from tests.scenarios.scenario import scenario

from benchmarks.known_joint import TRUTH, sessions, settings_with
from rigidimeter.analysis import estimation
from rigidimeter.analysis.estimation import fit_epoch
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings

Array = NDArray[np.float64]

LOST_S = 8.0, 8.5
"""What is lost of an epoch."""

LOST_HEADER = ["", "SD of J, B, K", "held by 95 % intervals"]
PUSHED_HEADER = [
    "torque of the subject",
    "controller of the settings",
    "mean error of J, B, K",
    "held by 95 % intervals",
    "cautions (% of epochs, from 5)",
]

PUSHED = {
    "0.5 N·m, 0.3 to 4 Hz": {"voluntary_nm": 0.5},
    "0.2 N·m, 0.3 to 4 Hz, soft skirts": {"voluntary_nm": 0.2, "voluntary_skirts": True},
    "tremor of 1 N·m": {"tremor_nm": 1.0},
    "0.2 N·m, 0.3 to 30 Hz": {"voluntary_nm": 0.2, "voluntary_hz": (0.3, 30.0)},
    "0.5 N·m, 0.3 to 30 Hz": {"voluntary_nm": 0.5, "voluntary_hz": (0.3, 30.0)},
    "1 N·m, 0.3 to 30 Hz": {"voluntary_nm": 1.0, "voluntary_hz": (0.3, 30.0)},
}
EPOCHS = 4
SEEN = 0.05
"""Cautions of fewer epochs are not shown."""


def lost_rows(n: int) -> Iterator[Sequence[object]]:
    """Yield what `iv` gives of an epoch that is whole, and of one of which a stretch is lost."""
    settings = settings_with(0.1)
    found: dict[str, list[tuple[Array, Array]]] = {}
    for epochs in sessions(settings, n, 17):
        for epoch in epochs:
            for way, recorded in (("nothing lost", epoch), ("lost", _lost(epoch))):
                fit = fit_epoch(recorded, "iv", settings)
                held = (fit.low <= TRUTH) & (fit.high >= TRUTH)
                found.setdefault(way, []).append((fit.value, held))
    for way, both in found.items():
        values, held = map(np.array, zip(*both, strict=True))
        yield way, _three(values.std(axis=0) / TRUTH, ".2f"), _three(held.mean(axis=0), ".0f")


def _lost(epoch: Epoch) -> Epoch:
    """Return the epoch without what was measured in a stretch; the command stays whole."""
    channels = dict(epoch.channels)
    for name in ("torque_nm", "angle_rad", "velocity_rad_s"):
        one = epoch.channels[name]
        rows = (one.time_s <= LOST_S[0]) | (one.time_s >= LOST_S[1])
        channels[name] = Channel(name, one.time_s[rows], one.values[rows])
    return replace(epoch, channels=channels)


def pushed_rows(n: int) -> Iterator[Sequence[object]]:
    """Yield what torque and motion alone give of so many epochs, by a right and a wrong loop."""
    for name, subject in PUSHED.items():
        for factor in (1.0, 2.0):
            case = scenario(name, subject=subject)
            settings = _controller(case.analysed_with(), factor)
            errors, held, cautions = [], [], Counter[str]()
            for number in range(max(n // EPOCHS, 1)):
                epochs, (truth, *_) = case.simulated(number, EPOCHS)
                alone = list(map(measured_alone, epochs))
                fits = estimation.estimate(alone, settings, "bandlimited").fits
                for fit in fits:
                    errors.append(fit.value / truth - 1)
                    held.append((fit.low <= truth) & (truth <= fit.high))
                    cautions.update({one.name for one in fit.findings if one.level != "note"})
            told = (
                f"{one} {100 * count / len(errors):.0f}"
                for one, count in cautions.most_common()
                if count >= SEEN * len(errors)
            )
            yield (
                name,
                "its own" if factor == 1.0 else f"{factor:g} times its own",
                _three(np.mean(errors, axis=0), "+.1f"),
                _three(np.mean(held, axis=0), ".0f"),
                ", ".join(told) or "–",
            )


def _controller(settings: Settings, factor: float) -> Settings:
    known = settings.controller
    values = {
        "inertia_kg_m2": factor * known.inertia_kg_m2,
        "damping_nm_s_rad": factor * known.damping_nm_s_rad,
    }
    return settings.model_copy(update={"controller": known.model_copy(update=values)})


def _three(shares: Array, digits: str) -> str:
    return " ".join(f"{100 * share:{digits}}" for share in shares)
