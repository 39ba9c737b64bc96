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

With σ_d the SD between days in one condition and ρ the correlation of the two conditions of a day,
σ_b = σ_d √(1 − ρ).

The test is `rigidimeter.analysis.statistics.day_difference`. Below three days, or three subjects,
that is not the paired t-test alone, so three is the smallest number here.
"""

from __future__ import annotations

import difflib
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import scipy

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.settings import Settings, SubjectSettings
from rigidimeter.model import Array
from rigidimeter.planning.precision import PARAMETER_NAMES, predicted_precision

EPOCHS_A_DAY = (1, 2, 3, 5, 10, 20)
"""Epochs a day in each condition for which days and subjects are found."""

HOLM_MEASURES = 3
"""J, B and K are tested together: by Holm's method the first of them has α/3."""

_FEWEST = 3
_MOST = 1000
"""Days or subjects, where the search ends."""

_CERTAIN = 40.0
"""Above this noncentrality the power is 1, and the series of the distribution may not converge."""

_NAMES = {"inertia": 0, "damping": 1, "stiffness": 2}

CORRELATION = 0.5
"""ρ where it is not known; chosen, as for the weights of the test by days."""

_OF_EFFECT = 0.5


@dataclass(frozen=True)
class Scatter:
    """How much one measure varies beyond the error of an epoch: SDs in % of a condition's value.

    Attributes
    ----------
    between_epochs_percent : float
        σ_e, within a day and a condition, without the error of the measurement.
    between_days_percent : float
        σ_d, of one condition.
    condition_in_day_percent : float
        σ_b, what remains of σ_d in the difference of two conditions of one day, over √2.
    source : str
        Where the numbers are from.
    between_subjects : float
        τ as a share of the difference.
    """

    between_epochs_percent: float
    between_days_percent: float
    condition_in_day_percent: float
    source: str
    between_subjects: float = _OF_EFFECT


DAY_CV_PERCENT = {"inertia": 2.0, "damping": 9.0, "stiffness": 12.0}
EPOCH_CV_PERCENT = {"inertia": 2.0, "damping": 12.0, "stiffness": 16.0}
"""Coefficients of variation between days and between epochs of a day.

Table 2 of the paper: r = .35 and .37 with 78 + 23 epochs mean that OFF and DBS differ by 0.92 and
0.98 standard deviations. With B lower by 13 % and K by 18 % that is 15 and 20 % between epochs of
all days. How much of it is between days the paper does not say: a third of the variance is chosen,
and both of J.
"""

ASSUMED: Mapping[str, Scatter] = {
    name: Scatter(
        EPOCH_CV_PERCENT[name],
        DAY_CV_PERCENT[name],
        DAY_CV_PERCENT[name] * math.sqrt(1.0 - CORRELATION),
        "chosen" if name == "inertia" else "Table 2 of the paper; of days a third, chosen",
    )
    for name in _NAMES
}
"""Where no study of the user's own is named."""


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
    days, days_holm : int or None
        Of one subject, both conditions on each, for the one measure that is tested and for the
        first of `HOLM_MEASURES` by Holm's method; None if 1000 are not enough.
    subjects : int or None
        With one day each, for the one measure.
    day_sd : float
        √v, the SD of the difference of one day, in the parameter's unit.
    """

    epochs: tuple[int, int]
    days: int | None
    days_holm: int | None
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
    needed: tuple[Needed, ...]
    planned: Needed | None


def planned_epochs(settings: Settings) -> dict[str, int]:
    """Return how many PRBS epochs the protocol holds for each condition of the settings."""
    counts = dict.fromkeys(settings.subject, 0)
    for block in settings.protocol.blocks:
        if block.task == "prbs":
            counts[block.condition] += block.epochs
    return counts


def detect(
    settings: Settings,
    perturbation_nm: Array,
    wanted: WantedDifference,
    *,
    scatter: Mapping[str, Scatter] | None = None,
    power: float = 0.8,
    alpha: float = 0.05,
) -> Detection:
    """Return the days, epochs a day and subjects that a difference needs.

    The first condition of the settings is the baseline; the other one is its joint with the
    parameter lowered by the amount (or raised, for a negative amount). Standard errors are those of
    `iv` with J, B and K of each epoch. Without `scatter` it is `ASSUMED`, with the coefficient of
    variation between epochs of the baseline where the settings give it.

    Raises
    ------
    UserError
        If the power or level is out of range, or the other joint would not exist.
    """
    if not (0.0 < power < 1.0 and 0.0 < alpha < 1.0):
        raise UserError(
            f"--power {power:g} and --alpha {alpha:g} must both be between 0 and 1, for example "
            "0.8 and 0.05"
        )
    condition, subject = next(iter(settings.subject.items()))
    place = _NAMES[wanted.parameter]
    key = PARAMETER_NAMES[place]
    value = float(getattr(subject, key))
    difference = value * wanted.amount / 100.0 if wanted.percent else wanted.amount
    if difference >= value:
        raise UserError(_too_large(wanted, condition, value))
    errors = [
        predicted_precision(
            perturbation_nm, settings, subject.model_copy(update={key: level})
        ).iv.free[place]
        for level in (value, value - difference)
    ]
    found = Detection(
        wanted=wanted,
        condition=condition,
        value=value,
        difference=difference,
        epoch_se=(errors[0], errors[1]),
        scatter=scatter[wanted.parameter]
        if scatter is not None
        else _assumed(wanted.parameter, condition, subject),
        power=power,
        alpha=alpha,
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


def day_difference_sd(
    scatter: Scatter,
    values: tuple[float, float],
    epoch_se: tuple[float, float],
    epochs: tuple[int, int],
) -> float:
    """Return √v, the SD of the difference of two conditions on one day, in the unit of `values`.

    Parameters
    ----------
    scatter : Scatter
    values, epoch_se : (float, float)
        Of both conditions, and the standard errors of one epoch, in one unit.
    epochs : (int, int)
        Of a day, in each condition.

    Examples
    --------
    >>> round(day_difference_sd(Scatter(10.0, 0.0, 0.0, ""), (1.0, 1.0), (0.0, 0.0), (2, 2)), 3)
    0.1
    """
    of_day = scatter.condition_in_day_percent / 100.0
    of_epoch = scatter.between_epochs_percent / 100.0
    return math.sqrt(
        sum(
            (of_day * value) ** 2 + ((of_epoch * value) ** 2 + se**2) / n
            for value, se, n in zip(values, epoch_se, epochs, strict=True)
        )
    )


def paired_power(difference: float, sd: float, pairs: float, *, alpha: float = 0.05) -> float:
    """Return the power of the two-sided paired t-test to find the difference with its sign.

    Parameters
    ----------
    difference, sd : float
        Mean and SD of the differences of pairs, in one unit.
    pairs : float
        Their number, above 1.
    alpha : float
        The level of the test.

    Raises
    ------
    ValueError
        If a number is out of range.

    Examples
    --------
    >>> round(paired_power(1.0, 1.0, 10), 3)
    0.803
    """
    if pairs <= 1 or sd < 0 or not 0 < alpha < 1:
        raise ValueError(
            f"more than 1 pair, an SD of at least 0 and alpha between 0 and 1 are needed, got "
            f"{pairs}, {sd} and {alpha}"
        )
    if abs(difference) * math.sqrt(pairs) > _CERTAIN * sd:
        return 1.0
    shift = abs(difference) * math.sqrt(pairs) / sd
    critical = float(scipy.stats.t.isf(alpha / 2.0, pairs - 1))
    return float(scipy.stats.nct.sf(critical, pairs - 1, shift))


def pairs_needed(
    difference: float, sd: float, power: float = 0.8, *, alpha: float = 0.05
) -> int | None:
    """Return the fewest pairs, from three, that reach the power; None if 1000 do not.

    Raises
    ------
    ValueError
        If a number is out of range.
    """
    low, high = _FEWEST - 1, _FEWEST
    while paired_power(difference, sd, high, alpha=alpha) < power:
        low, high = high, 2 * high
        if low >= _MOST:
            return None
    while high - low > 1:
        middle = (low + high) // 2
        if paired_power(difference, sd, middle, alpha=alpha) < power:
            low = middle
        else:
            high = middle
    return high if high <= _MOST else None


def _needed(found: Detection, epochs: tuple[int, int]) -> Needed:
    values = found.value, found.value - found.difference
    sd = day_difference_sd(found.scatter, values, found.epoch_se, epochs)
    of_subjects = math.hypot(found.scatter.between_subjects * found.difference, sd)
    return Needed(
        epochs=epochs,
        days=pairs_needed(found.difference, sd, found.power, alpha=found.alpha),
        days_holm=pairs_needed(
            found.difference, sd, found.power, alpha=found.alpha / HOLM_MEASURES
        ),
        subjects=pairs_needed(found.difference, of_subjects, found.power, alpha=found.alpha),
        day_sd=sd,
    )


def _too_large(wanted: WantedDifference, condition: str, value: float) -> str:
    """Return why a difference leaves nothing of the parameter."""
    parameter = PARAMETERS[_NAMES[wanted.parameter]]
    amount, place = f"{wanted.amount:g}", f"subject.{condition}.{parameter.name} = {value:.4g}"
    if wanted.percent or wanted.amount >= 100.0:
        return (
            f"--detect {wanted.parameter}={amount}{'%' if wanted.percent else ''}: nothing of "
            f"{parameter.symbol} would be left ({place}); name a smaller difference"
        )
    return (
        f"--detect {wanted.parameter}={amount}: {amount} {parameter.unit} is "
        f"{'more than' if wanted.amount > value else 'all of'} {parameter.symbol} itself "
        f"({place}); did you mean {amount} %?"
    )


def _assumed(parameter: str, condition: str, subject: SubjectSettings) -> Scatter:
    """Return what is assumed, with the SD between epochs of the settings where it is above 0.

    0 is the default of a virtual joint, and no joint of a person.
    """
    assumed, of_epochs = ASSUMED[parameter], float(getattr(subject, f"{parameter}_cv_percent"))
    if of_epochs == 0.0:
        return assumed
    return replace(
        assumed,
        between_epochs_percent=of_epochs,
        source=f"epochs: subject.{condition} of the settings; days: {assumed.source}",
    )
