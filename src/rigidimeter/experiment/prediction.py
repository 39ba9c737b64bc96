"""What is known before anyone is perturbed: stability, standard errors, epochs needed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from rigidimeter.dynamics import Stability, loop_stability
from rigidimeter.dynamics.velocity_drive import Array
from rigidimeter.errors import UserError
from rigidimeter.experiment.epochs_needed import (
    Effect,
    SampleSize,
    epoch_sd,
    ranksum_power,
    sample_size,
)
from rigidimeter.experiment.multisine import crest_factor, multisine_nm
from rigidimeter.experiment.precision import PARAMETERS, Precision, predicted_precision
from rigidimeter.settings import Settings

__all__ = [
    "Alternative",
    "Detection",
    "Foresight",
    "Wanted",
    "compare_multisine",
    "detect",
    "foresee",
    "planned_epochs",
]

_NAMES = {"inertia": 0, "damping": 1, "stiffness": 2}
_SIZES = (5, 10, 20, 40, 80)


@dataclass(frozen=True)
class Foresight:
    """Stability of the loop, and the precision of one epoch in each condition.

    `remarks` says of each condition without an entry in `precision` why it has none.
    """

    stability: Stability
    precision: dict[str, Precision]
    remarks: tuple[str, ...]


@dataclass(frozen=True)
class Alternative:
    """A multisine beside the PRBS, for one condition.

    `errors` holds, by what is held equal, the standard errors of J, B and K by `iv`.
    """

    torque_nm: Array
    crest: float
    errors: dict[str, dict[str, tuple[float, float, float]]]


@dataclass(frozen=True)
class Wanted:
    """A difference that is to be detected: of which parameter, and in what unit."""

    parameter: str
    amount: float
    percent: bool

    @classmethod
    def parse(cls, text: str) -> Wanted:
        """Read ``damping=20%`` or ``stiffness=0.3``.

        Raises
        ------
        UserError
            If it cannot be read.
        """
        name, equals, amount = text.partition("=")
        number = amount.strip().removesuffix("%")
        if name.strip() not in _NAMES or not equals:
            raise UserError(
                f"--detect {text} names no difference; write inertia, damping or stiffness, an "
                "equals sign and a number, such as damping=20% or stiffness=0.3"
            )
        try:
            value = float(number)
        except ValueError:
            value = math.nan
        if not (math.isfinite(value) and value != 0.0):
            raise UserError(
                f"--detect {text}: {amount.strip() or 'nothing'} is not a number other than 0, "
                "with % for a share of the first condition's value"
            )
        return cls(name.strip(), value, amount.strip().endswith("%"))


@dataclass(frozen=True)
class Detection:
    """How many epochs a wanted difference needs.

    Attributes
    ----------
    wanted : Wanted
    condition : str
        From whose joint the difference is counted.
    effect : Effect
        In the parameter's unit, with the SD of an epoch's value in both conditions.
    cv_percent : float
        The joint's own variation from epoch to epoch that is in it.
    needed : SampleSize
        In each condition.
    powers : dict of int to float
        For other numbers of epochs in each condition.
    planned : (int, int) or None
        PRBS epochs of the first two conditions in the protocol, where it has them.
    planned_power : float
        With those; NaN without them.
    """

    wanted: Wanted
    condition: str
    effect: Effect
    cv_percent: float
    needed: SampleSize
    powers: dict[int, float]
    planned: tuple[int, int] | None
    planned_power: float


def planned_epochs(settings: Settings) -> dict[str, int]:
    """Return how many PRBS epochs the protocol holds for each condition of the settings."""
    counts = dict.fromkeys(settings.subject, 0)
    for block in settings.protocol.blocks:
        if block.task == "prbs":
            counts[block.condition] += block.epochs
    return counts


def foresee(settings: Settings, perturbation_nm: Array) -> Foresight:
    """Return stability and precision; a condition whose loop is unstable has no precision."""
    stability = loop_stability(settings)
    precision, remarks = {}, []
    for name, subject in settings.subject.items():
        if not stability.conditions[name].stable:
            remarks.append(f"subject {name}: no standard errors, since the loop is unstable")
            continue
        try:
            precision[name] = predicted_precision(perturbation_nm, settings, subject)
        except UserError as obstacle:
            remarks.append(f"subject {name}: no standard errors, since {obstacle}")
    return Foresight(stability, precision, tuple(remarks))


def compare_multisine(settings: Settings, perturbation_nm: Array) -> Alternative:
    """Return the multisine and its standard errors beside those of the PRBS.

    Three comparisons: as it is, with the PRBS's peak torque; and stronger or weaker, so that the
    angle has the PRBS's standard deviation, or its peak.

    Raises
    ------
    UserError
        As `multisine_nm` and `predicted_precision`.
    """
    torque = multisine_nm(settings)
    errors: dict[str, dict[str, tuple[float, float, float]]] = {}
    for name, subject in settings.subject.items():
        ours = predicted_precision(perturbation_nm, settings, subject)
        its = predicted_precision(torque, settings, subject)
        scales = {
            "same_peak_torque": float(np.max(np.abs(perturbation_nm)) / np.max(np.abs(torque))),
            "same_angle_sd": ours.angle_sd_rad / its.angle_sd_rad,
            "same_peak_angle": ours.peak_angle_rad / its.peak_angle_rad,
        }
        errors[name] = {"prbs": ours.iv.free}
        for what, scale in scales.items():
            J, B, K = (error / scale for error in its.iv.free)
            errors[name][what] = (J, B, K)
    return Alternative(torque, crest_factor(torque), errors)


def detect(
    settings: Settings,
    perturbation_nm: Array,
    wanted: Wanted,
    *,
    power: float = 0.8,
    alpha: float = 0.05,
) -> Detection:
    """Return how many epochs a condition a difference needs.

    The first condition of the settings is the baseline; the other one is its joint with the
    parameter lowered by the amount (or raised, for a negative amount). Standard errors are those of
    `iv`: of B and K with the inertia held, as they are compared; of J in the fit of all three.

    Raises
    ------
    UserError
        If the power or level is out of range, the other joint would not exist, or no number of
        epochs is enough.
    """
    if not (0.0 < power < 1.0 and 0.0 < alpha < 1.0):
        raise UserError(
            f"--power {power:g} and --alpha {alpha:g} must both be between 0 and 1, for example "
            "0.8 and 0.05"
        )
    condition, subject = next(iter(settings.subject.items()))
    place = _NAMES[wanted.parameter]
    key = PARAMETERS[place]
    value = float(getattr(subject, key))
    difference = value * wanted.amount / 100.0 if wanted.percent else wanted.amount
    if value - difference <= 0.0:
        raise UserError(
            f"a {wanted.parameter} lower by {difference:.4g} leaves nothing of subject.{condition}."
            f"{key} = {value:.4g}; name a smaller difference"
        )
    cv_percent = float(getattr(subject, key.split("_", maxsplit=1)[0] + "_cv_percent"))
    spreads = []
    for level in (value, value - difference):
        joint = subject.model_copy(update={key: level})
        errors = predicted_precision(perturbation_nm, settings, joint).iv
        error = errors.free[0] if place == 0 else errors.fixed_inertia[place - 1]
        spreads.append(epoch_sd(error, level, cv_percent))
    effect = Effect(difference, *spreads)
    counts = list(planned_epochs(settings).values())
    planned = (counts[0], counts[1]) if len(counts) > 1 and min(counts[:2]) > 0 else None
    return Detection(
        wanted=wanted,
        condition=condition,
        effect=effect,
        cv_percent=cv_percent,
        needed=sample_size(effect, power, alpha=alpha),
        powers={n: ranksum_power(effect, n, n, alpha=alpha) for n in _SIZES},
        planned=planned,
        planned_power=ranksum_power(effect, *planned, alpha=alpha) if planned else math.nan,
    )
