"""Fit a sum of terms to torque and motion.

    F(M) = Σ c_k F(term_k(angle, velocity, acceleration; q)) + residual

Terms are computed from the wide-band signals and only then pass the band F, as the torque does:
F(v³) is not F(v)³. The band ends at `high`, so samples are kept at about 2.5 times that. Where it
begins above 0 Hz no mean survives, and an offset cannot be fitted.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidimeter.analysis.estimation.linear_solution import solve_named
from rigidimeter.analysis.estimation.signals import Array, Signals
from rigidimeter.analysis.estimation.terms.catalogue import REFLEXES, parse_terms, term_named
from rigidimeter.analysis.estimation.terms.reflex import FIR_SPACING_S
from rigidimeter.analysis.estimation.terms.regressors import Design
from rigidimeter.analysis.estimation.terms.residual_tests import ResidualTest, residual_test
from rigidimeter.analysis.estimation.uncertainty import hac_covariance

NEAR_BOUND = 1e-3
"""A parameter this near to its bound, as a share of its range, was not found inside."""


@dataclass(frozen=True)
class TermParameter:
    """One number of a fit, with one standard error; NaN where the data give none."""

    term: str
    name: str
    value: float
    standard_error: float
    unit: str


@dataclass(frozen=True)
class TermsFit:
    """A fitted sum of terms.

    Attributes
    ----------
    terms : tuple of str
        With the direction of a reflex decided.
    parameters : tuple of TermParameter
        The gain of a `reflex-fir` follows its responses, of which it is the sum.
    linear, nonlinear : arrays
        Coefficients c, and q of the reflex paths.
    vaf_percent : float
        100 (1 − var(residual)/var(torque)), both in the band.
    aic, bic : float
        N ln(RSS/n) + 2 p and N ln(RSS/n) + p ln N, with N = 2 · bandwidth · T independent samples.
        They compare fits of the same signals in the same band.
    independent_samples : float
        N.
    test : ResidualTest
    remarks : tuple of str
        What to know before believing it, a sentence each.
    """

    terms: tuple[str, ...]
    parameters: tuple[TermParameter, ...]
    linear: Array
    nonlinear: Array
    band_hz: tuple[float, float]
    rate_hz: float
    trim_s: float
    vaf_percent: float
    aic: float
    bic: float
    independent_samples: float
    condition_number: float
    test: ResidualTest
    remarks: tuple[str, ...] = ()

    @property
    def n_parameters(self) -> int:
        """Linear and nonlinear parameters."""
        return int(self.linear.size + self.nonlinear.size)

    def __getitem__(self, name: str) -> TermParameter:
        """Return a parameter by `term`, or by `term name` where a term has several."""
        for parameter in self.parameters:
            if name in (parameter.term, f"{parameter.term} {parameter.name}"):
                return parameter
        raise KeyError(name)


def fit_terms(
    motion: Signals,
    names: str | Sequence[str],
    band_hz: tuple[float, float],
    trim_s: float = 1.0,
) -> TermsFit:
    """Fit the named terms in a band.

    Parameters
    ----------
    motion : Signals
        Wide-band: it must reach well above the band.
    names : str or sequence of str
        For example ``"inertia,damping,stiffness,reflex-fir+"``; see `catalogue`.
    band_hz : (float, float)
        From 0 Hz where a mean is to be explained.
    trim_s : float
        Dropped at each end, where the filter had no neighbours and a reflex no past.

    Raises
    ------
    UserError
        If a name is unknown.
    ValueError
        If the data cannot distinguish terms, or the band cannot carry a term.
    """
    terms = parse_terms(names)
    if "offset" in terms and band_hz[0] > 0:
        raise ValueError(
            f"offset is constant and does not pass a band that begins at {band_hz[0]:g} Hz; begin "
            "the band at 0 Hz or leave offset out"
        )
    undecided = [name for name in terms if name in REFLEXES and name[-1] not in "+-"]
    if undecided:
        return _both_directions(motion, terms, undecided[0], band_hz, trim_s)
    return _fit(Design(motion, terms, band_hz, trim_s))


def _both_directions(
    motion: Signals,
    terms: tuple[str, ...],
    undecided: str,
    band_hz: tuple[float, float],
    trim_s: float,
) -> TermsFit:
    fits = []
    for sign in "+-":
        decided = [undecided + sign if name == undecided else name for name in terms]
        fits.append(_fit(Design(motion, decided, band_hz, trim_s)))
    # A reflex resists stretch; a direction that needs a negative gain is not one.
    worse, better = sorted(fits, key=lambda fit: (_gain(fit, undecided) > 0, fit.vaf_percent))
    side = "positive" if f"{undecided}+" in better.terms else "negative"
    remark = (
        f"{undecided}: the data decided for stretch by motion toward {side} angle "
        f"(VAF {better.vaf_percent:.2f} %, the other direction {worse.vaf_percent:.2f} %)"
    )
    return replace(better, remarks=(remark, *better.remarks))


def _gain(fit: TermsFit, kind: str) -> float:
    term = next(name for name in fit.terms if name.rstrip("+-") == kind)
    return fit[f"{term} gain"].value


def _fit(design: Design) -> TermsFit:
    target, band_hz = design.torque_nm[design.keep], design.band_hz
    if not float(np.ptp(target)) > 0:
        raise ValueError("the torque is constant in the band")
    nonlinear = design.search()
    columns = design.columns(nonlinear)
    solution = solve_named(columns, target, design.names)
    residual = target - columns @ solution.values
    n, p = target.size, columns.shape[1] + nonlinear.size
    independent = min(float(n), 2.0 * (band_hz[1] - band_hz[0]) * n / design.rate_hz)
    parameters, remarks = _parameters(design, solution.values, nonlinear, residual)
    misfit = independent * math.log(max(float(residual @ residual) / n, np.finfo(float).tiny))
    return TermsFit(
        terms=design.terms,
        parameters=parameters,
        linear=solution.values,
        nonlinear=nonlinear,
        band_hz=band_hz,
        rate_hz=design.rate_hz,
        trim_s=design.trim_s,
        vaf_percent=100.0 * (1.0 - float(np.var(residual)) / float(np.var(target))),
        aic=misfit + 2.0 * p,
        bic=misfit + p * math.log(independent),
        independent_samples=independent,
        condition_number=solution.condition_number,
        test=residual_test(residual, design.velocity_rad_s[design.keep], design.rate_hz, band_hz),
        remarks=tuple(remarks),
    )


def _parameters(
    design: Design, linear: Array, nonlinear: Array, residual: Array
) -> tuple[tuple[TermParameter, ...], list[str]]:
    """Return the parameters with HAC errors, linear and nonlinear ones from one Jacobian."""
    low, high = design.bounds
    slopes, remarks = [], []
    for step in np.diag(1e-4 * (high - low)):
        rise = design.columns(nonlinear + step) - design.columns(nonlinear - step)
        slopes.append(rise @ linear / (2.0 * step.sum()))
    jacobian = np.column_stack((design.columns(nonlinear), *slopes))
    inner = [f"q{k}" for k in range(nonlinear.size)]
    covariance = np.full((jacobian.shape[1],) * 2, math.nan)
    try:
        inverse = solve_named(jacobian, residual, [*design.names, *inner]).bread
        covariance = hac_covariance(inverse, jacobian * residual[:, None]).covariance
    except ValueError as obstacle:
        remarks.append(f"no standard errors: {obstacle}")
    errors = np.sqrt(np.diag(covariance))
    found: list[TermParameter] = []
    column, q = 0, 0
    for term in design.terms:
        plain = term_named(term)
        names = ("",) if plain is not None else design.kernels[term].columns
        unit = "N·m/rad" if term.startswith("reflex-fir") else "N·m·s/rad"
        unit = unit if plain is None else plain.unit
        part = slice(column, column + len(names))
        column += len(names)
        for name, value, error in zip(names, linear[part], errors[part], strict=True):
            found.append(TermParameter(term, name, float(value), float(error), unit))
        if plain is not None:
            continue
        one = design.kernels[term]
        if one.kind == "reflex-fir":
            spread = FIR_SPACING_S * math.sqrt(float(np.sum(covariance[part, part])))
            area = FIR_SPACING_S * float(np.sum(linear[part]))
            found.append(TermParameter(term, "gain", area, spread, "N·m·s/rad"))
        gain = found[-1]
        if gain.value < 0:
            remarks.append(
                f"{term}: the gain is negative, {gain.value:.3g} N·m·s/rad; a reflex resists "
                "stretch, so this term explains something else"
            )
        for name, unit, bottom, top in zip(
            one.nonlinear, one.units, one.low, one.high, strict=True
        ):
            value, error = float(nonlinear[q]), float(errors[linear.size + q])
            q += 1
            if min(value - bottom, top - value) < NEAR_BOUND * (top - bottom):
                remarks.append(
                    f"{term}: the {name} came to its bound, {value:.3g} {unit}; the data do not "
                    "determine it, and its error means nothing"
                )
            found.append(TermParameter(term, name, value, error, unit))
    return tuple(found), remarks
