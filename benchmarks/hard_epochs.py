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
from rigidimeter.analysis.estimation.closedloop.linear_problems import (
    direct,
    instrumental,
    least_squares_start,
)
from rigidimeter.analysis.estimation.closedloop.observe import observe, observe_motion
from rigidimeter.analysis.estimation.closedloop.refine import fit_lines, shared_powers
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.analysis.estimation.uncertainty import of_fit
from rigidimeter.analysis.study import estimate
from rigidimeter.core.records import Channel, Epoch, Fit, LeftOut
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
    "share of information",
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

DOMINATED = 0.1
"""A line belongs to the subject where the noise is more than this share of the torque's power."""


def lost_rows(n: int) -> Iterator[Sequence[object]]:
    """Yield how `iv` takes an epoch whole, with a hole in its window, and as two segments."""
    settings = settings_with(0.1)
    found: dict[str, list[tuple[Array, Array]]] = {}
    for epochs in sessions(settings, n, 17):
        for epoch in epochs:
            hole = LeftOut(*LOST_S, "samples are lost", "lost")
            ways = {
                "nothing lost": [epoch],
                "one window with a hole": [replace(epoch, left_out=(hole,))],
                "two segments": [_part(epoch, -np.inf, LOST_S[0]), _part(epoch, LOST_S[1], np.inf)],
            }
            for way, parts in ways.items():
                seen = [one.once(observe) for one in prepare(parts, settings)]
                fit = fit_lines(seen, instrumental, least_squares_start(seen))
                ends = of_fit(fit.values, fit.covariance, fit.degrees, np.diag(fit.bound))
                held = (ends["low"] <= TRUTH) & (ends["high"] >= TRUTH)
                found.setdefault(way, []).append((fit.values, held))
    for way, both in found.items():
        values, held = map(np.array, zip(*both, strict=True))
        yield way, _three(values.std(axis=0) / TRUTH, ".2f"), _three(held.mean(axis=0), ".0f")


def _part(epoch: Epoch, start_s: float, stop_s: float) -> Epoch:
    """Return what was measured between two times; command and perturbation stay whole."""
    channels = dict(epoch.channels)
    for name in ("torque_nm", "angle_rad", "velocity_rad_s"):
        one = epoch.channels[name]
        rows = (one.time_s > start_s) & (one.time_s < stop_s)
        channels[name] = Channel(name, one.time_s[rows], one.values[rows])
    return replace(epoch, channels=channels)


def pushed_rows(n: int) -> Iterator[Sequence[object]]:
    """Yield what torque and motion alone give of so many epochs, by a right and a wrong loop."""
    for name, subject in PUSHED.items():
        for factor in (1.0, 2.0):
            case = scenario(name, subject=subject)
            settings = _controller(case.analysed_with(), factor)
            errors, held, shares, cautions = [], [], [], Counter[str]()
            for number in range(max(n // EPOCHS, 1)):
                epochs, (truth, *_) = case.simulated(number, EPOCHS)
                alone = list(map(measured_alone, epochs))
                fits = estimate(alone, "bandlimited", settings=settings).fits
                for epoch, fit in zip(alone, fits, strict=True):
                    errors.append(fit.value / truth - 1)
                    held.append((fit.low <= truth) & (truth <= fit.high))
                    shares.append(_share_dominated(epoch, settings, fit))
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
                _three(np.mean(shares, axis=0), ".0f"),
                ", ".join(told) or "–",
            )


def _controller(settings: Settings, factor: float) -> Settings:
    known = settings.controller
    values = {
        "inertia_kg_m2": factor * known.inertia_kg_m2,
        "damping_nm_s_rad": factor * known.damping_nm_s_rad,
    }
    return settings.model_copy(update={"controller": known.model_copy(update=values)})


def _share_dominated(epoch: Epoch, settings: Settings, fit: Fit) -> Array:
    """Return the share of Σ |X|²/S of each parameter that comes from lines of the subject."""
    (prepared,) = prepare([epoch], settings)
    (problem,) = direct([prepared.once(observe_motion)], fit.value)
    (power,) = shared_powers([problem], fit.value)
    information = np.abs(problem.regressors) ** 2 / power[:, None]
    dominated = power > DOMINATED * np.abs(problem.target) ** 2
    return np.asarray(information[dominated].sum(axis=0) / information.sum(axis=0))


def _three(shares: Array, digits: str) -> str:
    return " ".join(f"{100 * share:{digits}}" for share in shares)
