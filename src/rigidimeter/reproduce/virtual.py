"""Where virtual data come from: a study of the paper's design and sizes, with a subject of ours.

The measured data of the animal were never published. What needs them is shown with a virtual
subject instead, and says so. OFF has the joint of Sec. 3.4; the paper prints none for DBS, so DBS
and the scatter between epochs are chosen here, such that damping and stiffness differ about as much
as in Table 2. They prove nothing about the animal.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from rigidimeter.batch import simulate_epochs
from rigidimeter.records import Epoch
from rigidimeter.reproduce.imposed import imposed_epoch
from rigidimeter.settings import Settings, parse_settings
from rigidimeter.simulation import draw_joint

__all__ = ["PAPER_RATES", "Rating", "VirtualStudy", "study_settings", "virtual_study"]

PAPER_RATES: Mapping[str, Any] = {
    "torque": {"rate_hz": 100.0},
    "motion": {"rate_hz": 50.0, "jitter_s": 0.005},
}
"""Sec. 2.2: torque at 100 samples/s, angle and velocity at 50 with sporadic jitter."""

_SCATTER = {
    "inertia_cv_percent": 3.0,
    "damping_cv_percent": 15.0,
    "stiffness_cv_percent": 20.0,
    "voluntary_sd_nm": 0.01,
}
_SUBJECT: Mapping[str, Any] = {
    "OFF": {**_SCATTER, "damping_nm_s_rad": 0.1368, "stiffness_nm_rad": 1.751},
    "DBS": {**_SCATTER, "damping_nm_s_rad": 0.119, "stiffness_nm_rad": 1.44},
}

_EXAMINERS = ("A", "B", "C")
_EXAMINER_SD, _RATING_SD = 0.3, 0.45
_RATING_MEAN: Mapping[str, float] = {"OFF": 2.0, "DBS": 1.7}

_SINUSOIDS, _RATINGS = 1, 2
"""Keys that set the random streams apart; the PRBS epochs have that of the seed itself."""


class Rating(NamedTuple):
    """One score of one examiner, 0 to 3 in steps of 0.5."""

    condition: str
    examiner: str
    score: float


@dataclass(frozen=True)
class VirtualStudy:
    """Epochs and ratings of both conditions.

    Attributes
    ----------
    settings : Settings
    prbs, sinusoid : tuple of Epoch
    ratings : tuple of Rating
    """

    settings: Settings
    prbs: tuple[Epoch, ...]
    sinusoid: tuple[Epoch, ...]
    ratings: tuple[Rating, ...]


def study_settings(seed: int) -> Settings:
    """Return the settings of the virtual study: the paper's rates, a subject that scatters."""
    values = {"seed": seed, "rig": dict(PAPER_RATES), "subject": dict(_SUBJECT)}
    return parse_settings(values, source="the virtual study")


def virtual_study(seed: int, counts: Mapping[str, Mapping[str, int]]) -> VirtualStudy:
    """Return a virtual study; the one place where its data are made.

    Parameters
    ----------
    seed : int
        Of everything random.
    counts : mapping
        Epochs by task (``prbs``, ``sinusoid``) and ratings (``ratings``), by condition. The
        ratings are shared out evenly between three examiners.
    """
    settings = study_settings(seed)
    conditions = [name for name, count in counts["prbs"].items() for _ in range(count)]
    batch = simulate_epochs(settings, len(conditions), conditions=conditions)
    return VirtualStudy(
        settings,
        tuple(batch.epoch(i) for i in range(len(batch))),
        _sinusoids(settings, counts["sinusoid"]),
        _ratings(seed, counts["ratings"]),
    )


def _sinusoids(settings: Settings, counts: Mapping[str, int]) -> tuple[Epoch, ...]:
    stream = np.random.SeedSequence(settings.seed, spawn_key=(_SINUSOIDS, 0))
    conditions = [name for name, count in counts.items() for _ in range(count)]
    epochs = []
    for number, (condition, seed) in enumerate(
        zip(conditions, stream.spawn(len(conditions)), strict=True), start=1
    ):
        rng = np.random.default_rng(seed)
        subject = settings.subject[condition]
        joint = draw_joint(subject, rng)
        epochs.append(
            imposed_epoch(
                joint,
                settings,
                label=str(number),
                condition=condition,
                subject=subject,
                rng=rng,
            )
        )
    return tuple(epochs)


def _ratings(seed: int, counts: Mapping[str, int]) -> tuple[Rating, ...]:
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_RATINGS, 0)))
    offsets = dict(
        zip(_EXAMINERS, _EXAMINER_SD * rng.standard_normal(len(_EXAMINERS)), strict=True)
    )
    ratings = []
    for condition, count in counts.items():
        for number in range(count):
            examiner = _EXAMINERS[number % len(_EXAMINERS)]
            felt = _RATING_MEAN[condition] + offsets[examiner] + _RATING_SD * rng.standard_normal()
            score = float(np.clip(np.round(2.0 * felt) / 2.0, 0.0, 3.0))
            ratings.append(Rating(condition, examiner, score))
    return tuple(ratings)
