"""How many days, epochs a day or subjects it takes to show a difference with the test by days.

The mean of n epochs of condition c on day d is

    x_cd = μ_c + a_d + b_cd + ē_cd,     Var ē_cd = (σ_ec² + s_c²)/n

a_d is what the day does to both conditions, such as how the cuff sits. It cancels in the difference
of a day, if both conditions are measured on it. What the day does to one condition, b_cd with SD
σ_bc, does not, nor do the epochs: σ_ec is the SD of the joint between them, s_c the standard error
of one epoch (`precision`). So the difference δ of two conditions, from D days with both, has

    v = σ_b1² + σ_b2² + (σ_e1² + s_1²)/n_1 + (σ_e2² + s_2²)/n_2,     SE = √(v/D)

and the paired t-test of days finds it, with its sign, with the power P(t' > t_D−1(1 − α/2)), t'
noncentral t with D − 1 degrees of freedom and noncentrality |δ|/SE. However many epochs a day, v is
at least σ_b1² + σ_b2². The SDs of the joint are shares of the value of their condition.

Of S subjects with one day each, δ differs between subjects with SD τ: SE = √((τ² + v)/S), tested
with S − 1 degrees of freedom.

α is the level of the first test of the primary measures (`PrimaryTable.first_level`). By Holm's
method the others are tested at higher levels, so the chance is at least the power at this one. In
a sequence a measure is shown only if those before it are: its chance is the product of the powers,
as of independent tests; measures that vary together have more.

The test is `rigidimeter.analysis.statistics.day_difference`. Below three days, or three subjects,
that is not the paired t-test alone, so three is the smallest number here.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.settings import Settings
from rigidimeter.core.study_files import PrimaryTable
from rigidimeter.model import Array
from rigidimeter.planning.assumed_scatter import Scatter, assumed_scatter, day_difference_sd
from rigidimeter.planning.paired_test import fewest_pairs, paired_power, pairs_needed
from rigidimeter.planning.precision import PARAMETER_NAMES, predicted_precision

EPOCHS_A_DAY = (1, 2, 3, 5, 10, 20)
"""Epochs a day in each condition for which days and subjects are found."""

_NAMES = {"inertia": 0, "damping": 1, "stiffness": 2}
_SYMBOLS = {PARAMETERS[place].symbol: name for name, place in _NAMES.items()}


@dataclass(frozen=True)
class WantedDifference:
    """A difference that is to be detected: of which parameter, and in what unit."""

    parameter: str
    amount: float
    percent: bool

    @classmethod
    def parse(cls, text: str) -> WantedDifference:
        """Read ``damping=20%`` or ``stiffness=0.3``.

        Raises
        ------
        UserError
            If it cannot be read.
        """
        name, equals, amount = text.partition("=")
        number = amount.strip().removesuffix("%")
        name = _SYMBOLS.get(name.strip(), name)
        if name.strip() not in _NAMES:
            near = difflib.get_close_matches(name.strip(), _NAMES, n=1)
            known = f"did you mean {near[0]}?" if near else "known: " + ", ".join(_NAMES)
            raise UserError(f'--detect {text}: unknown parameter "{name.strip()}"; {known}')
        if not equals:
            raise UserError(
                f"--detect {text}: the difference is missing; write a number behind an equals "
                f"sign, such as {name.strip()}=20%"
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
class Needed:
    """What a difference needs with so many epochs a day.

    Attributes
    ----------
    epochs : (int, int)
        Of a day, in each condition.
    days, days_alone : int or None
        Of one subject, both conditions on each: as one of the primary measures, and if it were the
        only one; None if 1000 are not enough.
    subjects : int or None
        With one day each, as one of the primary measures.
    day_sd : float
        √v, the SD of the difference of one day, in the parameter's unit.
    """

    epochs: tuple[int, int]
    days: int | None
    days_alone: int | None
    subjects: int | None
    day_sd: float


@dataclass(frozen=True)
class Detection:
    """What a wanted difference needs.

    Attributes
    ----------
    wanted : WantedDifference
    condition : str
        From whose joint the difference is counted.
    value, difference : float
        Of that joint, and what is to be detected, in the parameter's unit.
    epoch_se : (float, float)
        Predicted standard error of one epoch in both conditions.
    scatter : Scatter
    power, alpha : float
        The chance to show it, and the level of all primary measures together.
    primary : PrimaryTable
        What the study concludes from.
    level : float
        Of the first test of these; of inertia, which checks the instrument, `alpha`.
    before : tuple of Detection
        In a sequence, what must be shown first.
    needed : tuple of Needed
        For `EPOCHS_A_DAY`.
    planned : Needed or None
        For the PRBS epochs of the first two conditions in the protocol, where it has them.
    """

    wanted: WantedDifference
    condition: str
    value: float
    difference: float
    epoch_se: tuple[float, float]
    scatter: Scatter
    power: float
    alpha: float
    primary: PrimaryTable
    level: float
    before: tuple[Detection, ...]
    needed: tuple[Needed, ...]
    planned: Needed | None


def planned_epochs(settings: Settings) -> dict[str, int]:
    """Return how many PRBS epochs the protocol holds for each condition of the settings."""
    counts = dict.fromkeys(settings.subject, 0)
    for block in settings.protocol.blocks:
        if block.task == "prbs":
            counts[block.condition] += block.epochs
    return counts


def detections(
    settings: Settings,
    perturbation_nm: Array,
    wanted: Sequence[WantedDifference],
    *,
    primary: PrimaryTable | None = None,
    scatter: Mapping[str, Scatter] | None = None,
    power: float = 0.8,
    alpha: float = 0.05,
) -> tuple[Detection, ...]:
    """Return the days, epochs a day and subjects that differences need.

    The first condition of the settings is the baseline; the other one is its joint with the
    parameter lowered by the amount (or raised, for a negative amount). Standard errors are those of
    `iv` with J, B and K of each epoch. Without `scatter` it is `ASSUMED`, with the coefficient of
    variation between epochs of the baseline where the settings have one. J checks the instrument
    and is tested by itself.

    Parameters
    ----------
    settings : Settings
    perturbation_nm : array, shape (n,)
    wanted : sequence of WantedDifference
    primary : PrimaryTable, optional
        What the study concludes from; K and B by Holm's method without it. What comes first in a
        sequence and is not among `wanted` is taken at its ``difference_percent``.
    scatter : mapping of str to Scatter, optional
    power, alpha : float

    Raises
    ------
    UserError
        If the power or level is out of range, the other joint would not exist, or a difference is
        in no primary measure.
    """
    if not (0.0 < power < 1.0 and 0.0 < alpha < 1.0):
        raise UserError(
            f"--power {power:g} and --alpha {alpha:g} must both be between 0 and 1, for example "
            "0.8 and 0.05"
        )
    family = PrimaryTable() if primary is None else primary
    sizes = {one.parameter: one for one in reversed(wanted)}

    @cache
    def found(one: WantedDifference) -> Detection:
        before: tuple[Detection, ...] = ()
        if one.parameter != "inertia":
            before = tuple(
                found(sizes.get(name, WantedDifference(name, family.difference_percent, True)))
                for name in _first_shown(one, family)
            )
        return _detection(
            settings,
            perturbation_nm,
            one,
            before=before,
            scatter=scatter,
            power=power,
            alpha=alpha,
            primary=family,
            level=alpha if one.parameter == "inertia" else family.first_level(alpha),
        )

    return tuple(map(found, wanted))


def _first_shown(wanted: WantedDifference, family: PrimaryTable) -> list[str]:
    """Return which parameters must be shown before the wanted one."""
    names = [name.partition("_")[0] for name in family.measures]
    if wanted.parameter not in names:
        raise UserError(
            f"--detect {wanted.parameter}: {wanted.parameter} is not a primary measure "
            f"({', '.join(names)}); add it to --primary, or leave it out here"
        )
    before = names[: names.index(wanted.parameter)] if family.rule == "sequence" else []
    if unknown := [name for name in before if name not in _NAMES]:
        raise UserError(
            f"--detect {wanted.parameter}: {unknown[0]} comes first in the sequence, and no chance "
            "to show it can be predicted; leave the difference out"
        )
    return before


def _detection(
    settings: Settings,
    perturbation_nm: Array,
    wanted: WantedDifference,
    *,
    before: tuple[Detection, ...],
    scatter: Mapping[str, Scatter] | None,
    power: float,
    alpha: float,
    primary: PrimaryTable,
    level: float,
) -> Detection:
    condition, subject = next(iter(settings.subject.items()))
    place = _NAMES[wanted.parameter]
    key = PARAMETER_NAMES[place]
    value = float(getattr(subject, key))
    difference = value * wanted.amount / 100.0 if wanted.percent else wanted.amount
    if difference >= value or (difference <= -value and not wanted.percent):
        raise UserError(_too_large(wanted, condition, value))
    errors = [
        predicted_precision(
            perturbation_nm, settings, subject.model_copy(update={key: each})
        ).iv.free[place]
        for each in (value, value - difference)
    ]
    found = Detection(
        wanted=wanted,
        condition=condition,
        value=value,
        difference=difference,
        epoch_se=(errors[0], errors[1]),
        scatter=scatter[wanted.parameter]
        if scatter is not None
        else assumed_scatter(wanted.parameter, condition, subject),
        power=power,
        alpha=alpha,
        primary=primary,
        level=level,
        before=before,
        needed=(),
        planned=None,
    )
    counts = list(planned_epochs(settings).values())
    planned = len(counts) > 1 and min(counts[:2]) > 0
    return replace(
        found,
        needed=tuple(_needed(found, (n, n)) for n in EPOCHS_A_DAY),
        planned=_needed(found, (counts[0], counts[1])) if planned else None,
    )


def _needed(found: Detection, epochs: tuple[int, int]) -> Needed:
    tests = [(one.difference, *_sds(one, epochs)) for one in (*found.before, found)]

    def chance(pairs: int, of_subjects: bool) -> float:
        """Return the chance that this and all before it are shown."""
        return math.prod(
            paired_power(difference, sds[of_subjects], pairs, alpha=found.level)
            for difference, *sds in tests
        )

    *_, (_, sd, _) = tests
    return Needed(
        epochs=epochs,
        days=fewest_pairs(lambda days: chance(days, False), found.power),
        days_alone=pairs_needed(found.difference, sd, found.power, alpha=found.alpha),
        subjects=fewest_pairs(lambda subjects: chance(subjects, True), found.power),
        day_sd=sd,
    )


def _sds(found: Detection, epochs: tuple[int, int]) -> tuple[float, float]:
    """Return the SD of the difference of one day, and of one subject with one day."""
    values = found.value, found.value - found.difference
    sd = day_difference_sd(found.scatter, values, found.epoch_se, epochs)
    return sd, math.hypot(found.scatter.between_subjects * found.difference, sd)


def _too_large(wanted: WantedDifference, condition: str, value: float) -> str:
    """Return why a difference is as large as the parameter, or larger."""
    parameter = PARAMETERS[_NAMES[wanted.parameter]]
    amount, place = f"{wanted.amount:g}", f"subject.{condition}.{parameter.name} = {value:.4g}"
    if wanted.percent or abs(wanted.amount) >= 100.0:
        left = f"nothing of {parameter.symbol} would be left"
        if wanted.amount < 0:
            left = f"{parameter.symbol} would be more than twice as large"
        return (
            f"--detect {wanted.parameter}={amount}{'%' if wanted.percent else ''}: {left} "
            f"({place}); name a smaller difference"
        )
    return (
        f"--detect {wanted.parameter}={amount}: {abs(wanted.amount):g} {parameter.unit} is "
        f"{'more than' if abs(wanted.amount) > value else 'all of'} {parameter.symbol} itself "
        f"({place}); did you mean {amount} %?"
    )
