"""How many epochs it takes to detect a difference with the two-sided rank-sum test.

The test counts U = #{x > y} and rejects when |U − mn/2| − ½ ≥ z σ₀, σ₀² = mn(m + n + 1)/12 (what
`rigidimeter.analysis.statistics.ranksum` does without ties). For normal epochs x ~ N(δ, s_x²) and
y ~ N(0, s_y²) the distribution of U has (Lehmann 1975, ch. 2)

    E U = mn p₁
    var U = mn [p₁(1 − p₁) + (n − 1)(p₂ − p₁²) + (m − 1)(p₃ − p₁²)]

with p₁ = P(x > y), p₂ = P(x > y, x > y') and p₃ = P(x > y, x' > y), which are normal
probabilities of one and two dimensions. U counts mn correlated pairs, so it is taken
as beta-binomial with exactly this mean and variance; the power is the chance of the values of U
that reject. A normal U misses the simulated power by up to 9 points at five epochs, since U is
skewed and bounded; this one by 3. For large samples and small differences the power is that of the
t-test with 3/π = 0.955 as many epochs.

The spread of an epoch's value is that of the estimate and that of the joint together,

    s² = SE² + (between-epoch SD)²

References
----------
E. L. Lehmann, "Nonparametrics: Statistical Methods Based on Ranks", 1975, ch. 2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import scipy

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.model import Array
from rigidimeter.planning.precision import PARAMETER_NAMES, predicted_precision

_MAX_EPOCHS = 5000
"""Where the search for a sample size ends."""

_NAMES = {"inertia": 0, "damping": 1, "stiffness": 2}

_SIZES = (5, 10, 20, 40, 80)
"""Epochs in each condition for which the power is shown."""

_MANY_PAIRS = 10_000
"""Above this many pairs the beta-binomial is taken as the beta that it tends to."""

_CERTAIN = 1e-12
"""Variances below this count as zero."""


@dataclass(frozen=True)
class ExpectedEffect:
    """A difference to detect.

    Attributes
    ----------
    difference : float
        Between the centres of the two conditions, in the parameter's unit.
    sd_x, sd_y : float
        Of one epoch's value in each condition, in the same unit.
    """

    difference: float
    sd_x: float
    sd_y: float


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
    wanted : WantedDifference
    condition : str
        From whose joint the difference is counted.
    effect : ExpectedEffect
        In the parameter's unit, with the SD of an epoch's value in both conditions.
    cv_percent : float
        The joint's own variation from epoch to epoch that is in it.
    needed : int
        Epochs in each condition.
    power : float
        With that many.
    powers : dict of int to float
        For other numbers of epochs in each condition.
    planned : (int, int) or None
        PRBS epochs of the first two conditions in the protocol, where it has them.
    planned_power : float
        With those; NaN without them.
    """

    wanted: WantedDifference
    condition: str
    effect: ExpectedEffect
    cv_percent: float
    needed: int
    power: float
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


def detect(
    settings: Settings,
    perturbation_nm: Array,
    wanted: WantedDifference,
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
    key = PARAMETER_NAMES[place]
    value = float(getattr(subject, key))
    difference = value * wanted.amount / 100.0 if wanted.percent else wanted.amount
    if value - difference <= 0.0:
        raise UserError(
            f"a {wanted.parameter} lower by {difference:.4g} is not above 0, since subject."
            f"{condition}.{key} = {value:.4g}; name a smaller difference"
        )
    cv_percent = float(getattr(subject, key.split("_", maxsplit=1)[0] + "_cv_percent"))
    spreads = []
    for level in (value, value - difference):
        joint = subject.model_copy(update={key: level})
        errors = predicted_precision(perturbation_nm, settings, joint).iv
        error = errors.free[0] if place == 0 else errors.fixed_inertia[place - 1]
        spreads.append(epoch_sd(error, level, cv_percent))
    effect = ExpectedEffect(difference, *spreads)
    needed = sample_size(effect, power, alpha=alpha)
    counts = list(planned_epochs(settings).values())
    planned = (counts[0], counts[1]) if len(counts) > 1 and min(counts[:2]) > 0 else None
    return Detection(
        wanted=wanted,
        condition=condition,
        effect=effect,
        cv_percent=cv_percent,
        needed=needed,
        power=ranksum_power(effect, needed, needed, alpha=alpha),
        powers={n: ranksum_power(effect, n, n, alpha=alpha) for n in _SIZES},
        planned=planned,
        planned_power=ranksum_power(effect, *planned, alpha=alpha) if planned else math.nan,
    )


def epoch_sd(standard_error: float, value: float, cv_percent: float) -> float:
    """Return the SD of an epoch's estimate: its standard error and the joint's own variation.

    Parameters
    ----------
    standard_error : float
        Of one epoch.
    value : float
        The median of the parameter, in the same unit.
    cv_percent : float
        Coefficient of variation from epoch to epoch; log-normal, so that the SD is that share of
        the mean, value · √(1 + c²) · c.
    """
    share = cv_percent / 100.0
    return math.hypot(standard_error, value * share * math.sqrt(1.0 + share**2))


def ranksum_power(effect: ExpectedEffect, n_x: int, n_y: int, *, alpha: float = 0.05) -> float:
    """Return the power of the two-sided rank-sum test.

    Parameters
    ----------
    effect : ExpectedEffect
    n_x, n_y : int
        Epochs in each condition, at least 1.
    alpha : float
        The level of the test.

    Raises
    ------
    ValueError
        If a size is below 1, a spread is negative, or `alpha` is not between 0 and 1.

    Examples
    --------
    >>> round(ranksum_power(ExpectedEffect(1.0, 1.0, 1.0), 20, 20), 3)
    0.848
    """
    if n_x < 1 or n_y < 1 or effect.sd_x < 0 or effect.sd_y < 0 or not 0 < alpha < 1:
        raise ValueError(
            f"sizes of at least 1, spreads of at least 0 and alpha between 0 and 1 are needed, "
            f"got {n_x}, {n_y}, {effect.sd_x}, {effect.sd_y} and {alpha}"
        )
    pairs = n_x * n_y
    sigma = math.sqrt(pairs * (n_x + n_y + 1) / 12.0)
    # Smallest U that rejects on the upper side; the lower side mirrors it.
    upper = math.ceil(pairs / 2.0 + 0.5 + float(scipy.stats.norm.isf(alpha / 2.0)) * sigma - 1e-9)
    if upper > pairs:
        return 0.0  # even complete separation is not significant
    share, variance = _moments(effect, n_x, n_y)
    alone = pairs * share * (1.0 - share)  # the variance, if the pairs were independent
    if alone < _CERTAIN:
        return 1.0
    together = max((variance / alone - 1.0) / (pairs - 1), _CERTAIN)
    shape = 1.0 / together - 1.0
    if pairs > _MANY_PAIRS:  # the sum over counts is slow, and its steps no longer matter
        part = scipy.stats.beta(share * shape, (1.0 - share) * shape)
        return min(1.0, float(part.sf((upper - 0.5) / pairs) + part.cdf(1 - (upper - 0.5) / pairs)))
    count = scipy.stats.betabinom(pairs, share * shape, (1.0 - share) * shape)
    return min(1.0, float(count.sf(upper - 1) + count.cdf(pairs - upper)))


def sample_size(effect: ExpectedEffect, power: float = 0.8, *, alpha: float = 0.05) -> int:
    """Return the fewest epochs a condition, the same in both, that reach the power.

    Raises
    ------
    UserError
        If `_MAX_EPOCHS` in each condition are not enough, or the difference is 0.
    """
    if effect.difference == 0.0:
        raise UserError("a difference of 0 cannot be detected; name one that is not 0")
    if not 0 < power < 1:
        raise UserError(f"a power of {power:g} cannot be planned; it must be between 0 and 1")
    low, high = 1, 2
    while ranksum_power(effect, high, high, alpha=alpha) < power:
        low, high = high, 2 * high
        if low > _MAX_EPOCHS:
            raise UserError(
                f"a difference of {effect.difference:.4g} needs more than {_MAX_EPOCHS} epochs in "
                f"each condition at a spread of {effect.sd_x:.4g} from epoch to epoch"
            )
    while high - low > 1:
        middle = (low + high) // 2
        if ranksum_power(effect, middle, middle, alpha=alpha) < power:
            low = middle
        else:
            high = middle
    return high


def _moments(effect: ExpectedEffect, n_x: int, n_y: int) -> tuple[float, float]:
    """Return p₁ and the variance of U."""
    total = math.hypot(effect.sd_x, effect.sd_y)
    pairs = n_x * n_y
    if total == 0.0:
        return (0.5 + math.copysign(0.5, effect.difference)) if effect.difference else 0.5, 0.0
    d = effect.difference / total
    p1 = float(scipy.stats.norm.cdf(d))
    # x − y and x − y' share x, so their correlation is that part of the variance.
    share_x = (effect.sd_x / total) ** 2
    p2, p3 = _both_above(d, share_x), _both_above(d, 1.0 - share_x)
    variance = pairs * (p1 * (1.0 - p1) + (n_y - 1) * (p2 - p1 * p1) + (n_x - 1) * (p3 - p1 * p1))
    return p1, variance


def _both_above(d: float, correlation: float) -> float:
    """Return the chance that two standard normals of this correlation are both above −d."""
    if correlation <= 0.0:
        return float(scipy.stats.norm.cdf(d)) ** 2
    if correlation >= 1.0:
        return float(scipy.stats.norm.cdf(d))
    covariance = [[1.0, correlation], [correlation, 1.0]]
    return float(scipy.stats.multivariate_normal.cdf([d, d], mean=[0.0, 0.0], cov=covariance))
