"""The torque as a sum of named terms: fitted, compared, the right one recommended.

    M = Σ c C(motion, φ) + noise

`terms` has columns C. They are solved as J, B and K are (`solve`): at the lines, with what the
perturbation causes as the instruments where it was recorded, so that torque of the subject's own
does not bias them. Where the robot gives way to torque, each line counts by its noise: else what
the subject does comes back as motion. Where nothing says so, all count alike, which is least
squares in time (Parseval): what is left is then mostly misfit, and as noise it would hide the slow
lines that tell viscous from dry friction. Inner parameters φ, as the delay of a reflex, are
scanned, then solved as the coefficients of c ∂C/∂φ: errors hold that both are not known (Golub and
Pereyra 2003; Young and Jakeman 1979).

Models are compared by what they predict of blocks of about 1 s that they were not fitted to, each
line by its noise. Two of them by the ratio R of their squared errors, each block with its pair;
ln R has an interval by the jackknife over the blocks (Diebold and Mariano 1995). Without a
perturbation any linear term may follow the subject round the loop: terms that are not linear are
then fitted and compared in what no free linear filter of the motion explains.

A band from 0 Hz has one more line, that of the means: offset and friction of one side need it.

References: second-order reflex, Mirbagheri, Barbeau and Kearney 2000; halves by direction, Park et
al. 2011; whiteness, Ljung and Box 1978.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation import solve as by
from rigidimeter.analysis.estimation import terms as of
from rigidimeter.analysis.estimation.answer import Case, case_of, caused_motions
from rigidimeter.analysis.estimation.grid import SAME_TIME, Array, Complex, Grid
from rigidimeter.analysis.estimation.methods import direct, power_of, start_of
from rigidimeter.analysis.estimation.observation import Observation
from rigidimeter.analysis.estimation.published import least_squares
from rigidimeter.analysis.estimation.score import without_filter
from rigidimeter.analysis.estimation.signals import angle_at, values_at
from rigidimeter.analysis.estimation.solve import Problem, Solution, shortest, sums
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Fit
from rigidimeter.core.settings import Settings

JOINT = ("inertia", "damping", "stiffness")
REFLEX_KINDS = ("reflex", "reflex-fir", "reflex-second-order")
REFLEXES = tuple(kind + side for kind in REFLEX_KINDS for side in ("", "+", "-"))
"""`+` has the muscle stretched by motion toward positive angle, `-` the other; without a sign both
are tried, and the data decide."""

DIRECTIONS = (
    "followed by + or - for the direction of motion that stretches the muscle, or by nothing to "
    "let the data decide"
)
GROUPS = {
    f"directional-{one}": (f"{one}+", f"{one}-") for one in ("damping", "stiffness", "coulomb")
}

LEAST_PERCENT, MARGIN_PERCENT, FAR_PERCENT = 5.0, 1.0, 50.0
"""What a model must predict of the torque beyond an offset, and a larger one of the error of a
smaller. A rival that predicts so much of it, and may not be chosen, forbids the smaller."""

NEAR_BOUND, MOST_TRIED = 1e-3, 150
"""Of the range of an inner parameter, where it is held; steps of the search of several."""

BLOCK_S, FEWEST_BLOCKS, MOST_BLOCKS = 1.0, 8, 24
LAGS, BARTLETT = 20, 200
NOTHING, ALIKE = 1e-12, 1e-8

Seen = Sequence[Observation]
Powers = Sequence[Array]
Motions = Sequence[tuple[of.Motion, of.Motion]]
"""What is the instrument, and what was measured, of each epoch."""

Made = Callable[[Problem], Problem]


# --- Names


def _known() -> dict[str, of.Term]:
    """Return the terms by what `--terms` calls them: those that are asked for, then tested ones."""
    own = {one.asked: one for one in of.ASKED}
    more = [one for one in of.TERMS if one.asked and "," not in one.asked]
    return own | {one.asked: one for one in more if one.asked not in {*own, *GROUPS}}


def term_names() -> tuple[str, ...]:
    """Return what `--terms` takes; a reflex may be followed by a direction."""
    return (*(name for name in _known() if name not in REFLEXES), *GROUPS, *REFLEX_KINDS)


def parse_terms(text: str | Iterable[str]) -> tuple[str, ...]:
    """Return the terms that a comma-separated text, or a sequence of names, asks for.

    Raises
    ------
    UserError
        If a name is unknown or given twice, or there is none.
    """
    given = text.split(",") if isinstance(text, str) else list(text)
    names = [name.strip() for name in given if name.strip()]
    if not names:
        raise UserError("no term is named; for example inertia,damping,stiffness")
    where = f"{','.join(names)}: " if len(names) > 1 else ""
    found = [one for name in names for one in GROUPS.get(name, (name,))]
    for name in found:
        if name not in REFLEXES and name not in _known():
            offered = f"known: {', '.join(term_names())}"
            if name.startswith("reflex"):
                offered = f"a reflex is one of {', '.join(REFLEX_KINDS)}, {DIRECTIONS}"
            raise UserError(f"{where}there is no term {name!r}; {offered}")
        if found.count(name) > 1:
            raise UserError(f"{where}{name} is named twice; name each term once")
    signs = sorted(name[len(name.rstrip("+-")) :] for name in found if name in REFLEXES)
    if len(signs) > 1 and signs != ["+", "-"]:
        raise UserError(
            f"{where}one reflex fits each direction; name one reflex, or one with + and one with -"
        )
    return tuple(found)


def candidates(terms: Sequence[str]) -> list[tuple[str, ...]]:
    """Return models from J, B, K up to one further term: alone, and with each of the others.

    A reflex named without its dynamics is tried with each; of two halves beside their whole one is
    enough.
    """
    terms = parse_terms(terms)
    base = tuple(name for name in terms if name in (*JOINT, "offset")) or terms[:1]
    halves = [half for group in GROUPS.values() for half in group if half[:-1] in terms]
    more = [name for name in terms if name not in base and not (name in halves and "-" in name)]
    plain = [name for name in more if name.rstrip("+-") == "reflex"]
    more += [name.replace("reflex", kind) for name in plain for kind in REFLEX_KINDS[1:]]
    return list(dict.fromkeys([base, *((*base, name) for name in more)]))


# --- What is found


@dataclass(frozen=True)
class TermParameter:
    """One number of a fit, with one standard error; NaN where the data give none."""

    term: str
    name: str
    value: float
    standard_error: float
    unit: str


@dataclass(frozen=True)
class TermGain:
    """A term's coefficient from its part that no linear filter of the motion explains."""

    term: str
    value: float
    standard_error: float
    unit: str


class ResidualTest(NamedTuple):
    """Of what a fit leaves.

    Attributes
    ----------
    ljung_box_p : float
        Small: the residual is coloured.
    input_correlation, input_p : float
        The largest correlation with the velocity, or the part of it that the perturbation causes,
        at lags up to 20 samples, and its probability. Small p: a term may be missing.
    """

    ljung_box_p: float
    input_correlation: float
    input_p: float


class Gain(NamedTuple):
    """What is predicted better, in % of the error of the smaller model, with its interval."""

    percent: float
    low_percent: float
    high_percent: float

    @property
    def text(self) -> str:
        """Value and interval."""
        return f"{self.percent:.3g} % ({self.low_percent:.3g} to {self.high_percent:.3g} %)"

    def beats(self, least_percent: float) -> bool:
        """Return whether it is so large, and surely there."""
        return self.low_percent > 0 and self.percent > least_percent


class TermsFit(NamedTuple):
    """A fitted sum of terms.

    Attributes
    ----------
    parameters : tuple of TermParameter
        The gain of a `reflex-fir` follows its responses, of which it is the sum.
    n_parameters : int
    vaf_percent : float
        100 (1 − power of the residual/power of the torque), both in the band.
    aic, bic : float
        N · mean ln S + 2 p and N · mean ln S + p ln N, with S the power of what is left at each
        line and N = 2 · bandwidth · T independent samples (Whittle).
    independent_samples : float
    condition_number : float
    test : ResidualTest
    remarks : tuple of str
        What to know before believing it, a sentence each.
    solution : Solution
    """

    parameters: tuple[TermParameter, ...]
    n_parameters: int
    vaf_percent: float
    aic: float
    bic: float
    independent_samples: float
    condition_number: float
    test: ResidualTest
    remarks: tuple[str, ...]
    solution: Solution

    def of(self, name: str) -> TermParameter:
        """Return a parameter by `term`, or by `term name` where a term has several."""
        return next(p for p in self.parameters if name in (p.term, f"{p.term} {p.name}"))

    @property
    def misfit(self) -> float:
        """Mean ln S."""
        return (self.aic - 2 * self.n_parameters) / self.independent_samples


@dataclass(frozen=True, eq=False)
class ModelRow:
    """One model: its fit to all of the data, and where models are compared what it predicts.

    Attributes
    ----------
    terms : tuple of str
        With the direction of a reflex decided.
    fit : TermsFit or None
        None where the model could not be fitted; `problem` then says why.
    held_out : Gain or None
        What it predicts beyond an offset.
    beyond : tuple of TermGain
        The terms that are not linear in the motion, where no perturbation was recorded.
    problem : str
        Why it could not be fitted, or is not to be chosen.
    errors, beyond_errors : array, shape (b,)
        Of the prediction of each block; without a perturbation also of its part that no linear
        filter of the motion explains.
    """

    terms: tuple[str, ...]
    fit: TermsFit | None
    held_out: Gain | None = None
    beyond: tuple[TermGain, ...] = ()
    problem: str = ""
    errors: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    beyond_errors: Array = field(default_factory=lambda: np.zeros(0), repr=False)

    @property
    def held_out_vaf_percent(self) -> float:
        """The share that it predicts, NaN where models are not compared."""
        return np.nan if self.held_out is None else self.held_out.percent

    @property
    def name(self) -> str:
        """Its terms in one word."""
        return "+".join(self.terms)

    @property
    def size(self) -> int:
        """How many parameters it has."""
        return 0 if self.fit is None else self.fit.n_parameters

    @property
    def misfit(self) -> float:
        """That of its fit; infinite where there is none."""
        return np.inf if self.fit is None else self.fit.misfit

    @property
    def bent(self) -> frozenset[str]:
        """Its terms that are not linear in the motion."""
        return frozenset(one for one in self.terms if one in REFLEXES or not _known()[one].linear)


class Comparison(NamedTuple):
    """A row for each model, the recommended one among them (None where there is none)."""

    rows: tuple[ModelRow, ...]
    recommended: ModelRow | None
    reason: str


# --- Lines


@dataclass(frozen=True, eq=False)
class _FromZero(Grid):
    """A grid whose first line is that of the means, which counts as the others.

    Over the mean it is √(n Σw²/2): of white noise it has, being real, half a line. Its `constant`
    is half of that turned round, and gives the line of the acceleration its mean.
    """

    def lines(self, values: Array, derivatives: int = 0) -> Complex:
        """Return the lines, the first of x that of its mean."""
        found = super().lines(values, derivatives)
        found[0, ..., 0] = -2 * self.constant[0] * (values @ self.window[0] ** 2) / self.energy
        return found

    def coarse_lines(self, values: Array, window: Array | None = None) -> Complex:
        """Return the lines, the first that of the mean."""
        w, found = self.coarse_window[0], super().coarse_lines(values, window)
        mean = (values @ (w * (w if window is None else window)).T) / (w @ w)
        found[..., 0] = -2 * self.constant[0] * mean
        return found


class _WithMeans(Observation):
    """An epoch whose first line is that of the means, which is its own instrument."""

    def of_lines(self, lines: Complex) -> Complex:
        """Return those of `cause` behind the means that were measured."""
        return np.vstack([self.motion[:1], lines[: self.grid.line.size - 1]])


def from_zero(settings: Settings, high_hz: float) -> Settings:
    """Return settings by which epochs are observed in a band that begins at 0 Hz."""
    edges = {"band_low_hz": 0.0, "band_high_closed_loop_hz": high_hz}
    estimation = settings.estimation.model_copy(update=edges)
    return settings.model_copy(update={"estimation": estimation})


def _with_means(one: Observation) -> Observation:
    """Return an epoch with the line of the means, where its band begins at 0 Hz."""
    if one.settings.estimation.band_low_hz > 0:
        return one
    old, torque = one.grid, one.epoch.channels["torque_nm"]
    size = np.sqrt(old.time_s.size * old.energy / 2)
    line, constant = np.append(0, old.line), np.append(-size / 2, old.constant)
    grid = _FromZero(**vars(old) | {"line": line, "constant": constant})
    mean_nm = grid.lines(values_at(torque, old.time_s, SAME_TIME))[0, :1]
    velocity, angle = one.coarse
    means = grid.coarse_motion(velocity, angle + _zero(one))[:1]
    return _WithMeans(
        **vars(one) | {
            "grid": grid, "wider": None, "motion": np.vstack([means, one.motion]),
            "torque_nm": np.append(mean_nm, one.torque_nm),
            "terms_nm": np.append(0.0, one.terms_nm),
            "noise": None if one.noise is None else np.pad(one.noise, ((1, 0), (0, 0))),
        }
    )  # fmt: skip


def _zero(one: Observation) -> float:
    """Return the mean of the angle from the sensor's own zero."""
    known = "angle_rad" in one.epoch.channels
    return float(np.mean(angle_at(one.epoch, one.grid.time_s))) if known else 0.0


# --- One model


class _Placed(NamedTuple):
    """A term in a model.

    Attributes
    ----------
    term : Term
    names : list of str
        Of its columns.
    values : array, shape (q,)
        Their coefficients.
    inner : array, shape (d,)
    free : array of bool, shape (d,)
        Which inner parameters are fitted.
    """

    term: of.Term
    names: list[str]
    values: Array
    inner: Array
    free: NDArray[np.bool_]

    @property
    def parameters(self) -> Array:
        """Coefficients, then inner parameters that are fitted."""
        return np.append(self.values, self.inner[self.free])

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Which inner parameters are inside their bounds."""
        margin = NEAR_BOUND * (self.term.high - self.term.low)
        above, below = self.inner - self.term.low, self.term.high - self.inner
        return np.asarray((above >= margin) & (below >= margin))

    def at(self, parameters: Array) -> _Placed:
        """Return it at other parameters, inner ones within their bounds."""
        inner, count = self.inner.copy(), self.values.size
        inner[self.free] = parameters[count:]
        inner = np.clip(inner, self.term.low, self.term.high)
        return self._replace(values=parameters[:count], inner=inner)

    def rows(self, motion: of.Motion) -> Complex:
        """Return the columns, then those of the inner parameters that are fitted."""
        found, count = self.term.with_slopes(motion, self.inner, self.free), self.values.size
        found[count:] *= self.values[-1]
        return found


class _Sum(NamedTuple):
    """A sum of terms.

    Attributes
    ----------
    placed : list of _Placed
    case : Case
    joint : array, shape (3,)
        J, B and K of the loop, where they are no terms.
    """

    placed: list[_Placed]
    case: Case
    joint: Array

    def at(self, parameters: Array) -> _Sum:
        """Return it at other parameters."""
        ends = np.cumsum([one.parameters.size for one in self.placed])
        each = zip(self.placed, np.split(parameters, ends[:-1]), strict=True)
        return self._replace(placed=[one.at(own) for one, own in each])

    @property
    def motions(self) -> Motions:
        """The motion that is the instrument, in a loop with its J, B and K, and the measured."""
        own, joint = self.case.measured, self.joint.copy()
        for one in self.placed:
            if one.term.asked in JOINT:
                joint[JOINT.index(one.term.asked)] = one.values[0]
        looked = caused_motions(self.case, joint)
        if not self.case.caused:
            each = zip(own, self.case.instruments, strict=True)
            looked = [one._replace(lines=lines) for one, lines in each]
        return list(zip(looked, own, strict=True))

    def problems(self, motions: Motions) -> list[Problem]:
        """Return the problems, linearised at the inner parameters that are fitted."""
        inner = [np.append(np.zeros_like(one.values), one.inner[one.free]) for one in self.placed]
        found = []
        for one, both in zip(self.case.observations, motions, strict=True):
            Z, X = (np.concatenate([term.rows(own) for term in self.placed]).T for own in both)
            found.append(Problem(Z, X, one.torque_nm + X @ np.concatenate(inner), one))
        return found

    def pose(self, seen: Seen, parameters: Array) -> list[Problem]:
        """Return the problems at parameters, as `solve` asks for them."""
        del seen  # the case has them
        now = self.at(parameters)
        return now.problems(now.motions)


def _sum(terms: Iterable[of.Term], case: Case, joint: Array) -> _Sum:
    placed = []
    for term in terms:
        count = len(term.columns(case.measured[0], term.inner[:1]))
        names = ["gain" if term.muscle else ""] * count
        if term.muscle and count > 1:
            names = [f"response {lag_s:.3f} s" for lag_s in of.FIR_LAGS_S]
        held = np.zeros(term.steps.size, bool)
        placed.append(_Placed(term, names, np.zeros(count), term.inner[0], held))
    return _Sum(placed, case, joint)


def fit_model(observations: Seen, names: str | Sequence[str]) -> ModelRow:
    """Fit one model to epochs; one that cannot be fitted says why.

    Parameters
    ----------
    observations : sequence of Observation
        Of one condition. Of a band from 0 Hz (`from_zero`) where a mean is to be explained.
    names : str or sequence of str
        For example ``"inertia,damping,stiffness,reflex-fir+"``.

    Raises
    ------
    UserError
        If a name is unknown.
    """
    terms = parse_terms(names)
    low_hz = observations[0].settings.estimation.band_low_hz
    if "offset" in terms and low_hz > 0:
        refused = (
            f"offset is constant and does not pass a band that begins at {low_hz:g} Hz; begin the "
            "band at 0 Hz or leave offset out"
        )
        return ModelRow(terms, None, problem=refused)
    seen = [_with_means(one) for one in observations]
    free = next((name for name in terms if name in REFLEXES and name[-1] not in "+-"), "")
    tried = [tuple(one + side * (one == free) for one in terms) for side in "+-"]
    try:
        rows = [_fitted(seen, names) for names in dict.fromkeys(tried)]
    except ValueError as error:
        return ModelRow(terms, None, problem=str(error))
    if len(rows) == 1:
        return rows[0]
    # Of max(v, 0) and min(v, 0) the linear half is the same: what is left tells them apart.
    pushes = [any(one.value < 0 for one in _gains(row) if one.term[:-1] == free) for row in rows]
    order = sorted(range(2), key=lambda i: (pushes[i], rows[i].misfit))
    better, worse = (rows[i] for i in order)
    vaf = [row.fit.vaf_percent for row in (better, worse) if row.fit]
    remark = (
        f"{free}: the data decided for stretch by motion toward "
        f"{'negative' if order[0] else 'positive'} angle (VAF {vaf[0]:.2f} %, the other "
        f"direction {vaf[1]:.2f} %)"
    )
    fit = better.fit and better.fit._replace(remarks=(remark, *better.fit.remarks))
    return replace(better, fit=fit)


def _fitted(seen: Seen, names: tuple[str, ...]) -> ModelRow:
    """Fit one model whose terms are decided; ValueError says why not."""
    if not any(np.any(one.torque_nm) for one in seen):
        raise ValueError("the torque is constant in the band")
    joint, known, alike = start_of(seen), _known(), seen[0].loop is None
    case = case_of(direct(seen, joint))
    own = zip(case.measured, map(_zero, seen), strict=True)
    case = case._replace(measured=[one._replace(zero=zero) for one, zero in own])
    powers: Powers = [np.full(one.grid.line.size, one.grid.energy) for one in seen]
    try:
        alone = _sum([known[one] for one in JOINT], case, joint)
        solution = by.solve(seen, alone.pose, joint, powers if alike else None)
        joint, powers = solution.values, solution.powers
    except ValueError:
        pass  # the terms may do without one of J, B and K
    motions = _sum([], case, joint).motions
    model = _sum([known[one] for one in names], case, joint)
    begin = _least_squares(model)
    model = _searched(model, motions, powers)
    rest, _ = _left(model.problems(motions), powers)
    model, solution = _settled(model.at(begin), [rest * s for s in powers] if alike else None)
    solution = replace(solution, powers=by.noise_powers(solution.problems, solution.values))
    left = [one.residual(solution.values) for one in solution.problems]
    unexplained, whole = (sum(map(power_of, x)) for x in (left, [one.torque_nm for one in seen]))
    p = sum(one.values.size + one.inner.size for one in model.placed)
    count = sum(2 * one.grid.line.size / one.grid.spread for one in seen)
    each = zip(solution.powers, seen, strict=True)
    misfit = count * float(np.mean(np.concatenate([np.log(s / o.grid.energy) for s, o in each])))
    parameters, remarks = _parameters(model, solution.covariance)
    fit = TermsFit(
        parameters, p, 100 * (1 - unexplained / whole), misfit + 2 * p,
        misfit + p * float(np.log(count)), count, solution.condition_number,
        _residual_test(motions, left), remarks, solution,
    )  # fmt: skip
    row = ModelRow(names, fit)
    return row if case.caused else _beyond(row, model)


def _least_squares(model: _Sum) -> Array:
    """Return coefficients by least squares; ValueError names columns that are alike.

    From coarse samples all: to as many digits as columns that are alike agree then.
    """
    own = model.case.measured
    lines = [one.grid.coarse_motion(one.velocity, one.angle + one.zero) for one in own]
    rough = [one._replace(lines=x) for one, x in zip(own, lines, strict=True)]
    problems = model.problems([(one, one) for one in rough])
    names = [f"{one.term.asked} {name}".strip() for one in model.placed for name in one.names]
    whole = np.concatenate([np.column_stack([one.regressors, one.target]) for one in problems])
    both = np.concatenate([whole.real, whole.imag])
    return least_squares(both[:, :-1], both[:, -1], names).values


def _left(problems: Sequence[Problem], powers: Powers) -> tuple[float, Array]:
    """Return the mean of |r|²/S with the best coefficients, and these."""
    values = shortest(*sums(problems, powers))
    each = zip(problems, powers, strict=True)
    left = np.concatenate([np.abs(one.residual(values)) ** 2 / power for one, power in each])
    return float(np.mean(left)), values


def _searched(model: _Sum, motions: Motions, powers: Powers, made: Made = lambda one: one) -> _Sum:
    """Return the model with the inner parameters that leave least of what is made of problems."""
    several = [i for i, one in enumerate(model.placed) if one.inner.size]
    for place in several * min(len(several), 2):
        placed = list(model.placed)
        inner = _best(model, place, motions, powers, made)
        placed[place] = placed[place]._replace(inner=inner)
        model = model._replace(placed=placed)
    return model


def _best(model: _Sum, place: int, motions: Motions, powers: Powers, made: Made) -> Array:
    """Return the inner parameters of a term that leave least; twice as much where it pushes."""
    term, column = model.placed[place].term, sum(one.values.size for one in model.placed[:place])
    problems = model.problems(motions)

    def left(inner: Array) -> float:
        for (Z, X, *_), (looked, own) in zip(problems, motions, strict=True):
            X[:, column] = term.columns(own, inner[None])[0]
            same = looked.measured
            Z[:, column] = X[:, column] if same else term.seen(looked, inner[None])[0]
        remains, values = _left([made(one) for one in problems], powers)
        return remains * (2.0 if values[column] < 0 else 1.0)

    best = min(term.inner, key=left)
    if best.size > 1:  # a valley that steps of the solution do not find
        best = scipy.optimize.minimize(
            left, best, method="Nelder-Mead", options={"maxfev": MOST_TRIED},
            bounds=scipy.optimize.Bounds(term.low, term.high),
        ).x  # fmt: skip
    return np.asarray(best)


def _settled(model: _Sum, powers: Powers | None) -> tuple[_Sum, Solution]:
    """Return the model at its solution; inner parameters that the data do not tell are held."""
    placed = [one._replace(free=one.inside) for one in model.placed]
    while True:
        model, start = model._replace(placed=placed), [one.parameters for one in placed]
        try:
            solution = by.solve(model.case.observations, model.pose, np.concatenate(start), powers)
        except ValueError:
            if not any(np.any(one.free) for one in placed):
                raise
            placed = [one._replace(free=np.zeros_like(one.free)) for one in placed]
            continue
        new = model.at(solution.values)
        if all(np.all(one.inside[one.free]) for one in new.placed):
            return new, solution
        # What steps out of its bounds stays where it was found to leave least.
        each = [(old, one, one.inside) for old, one in zip(placed, new.placed, strict=True)]
        placed = [
            old._replace(inner=np.where(inside, one.inner, old.inner), free=old.free & inside)
            for old, one, inside in each
        ]


def _parameters(
    model: _Sum, covariance: Array
) -> tuple[tuple[TermParameter, ...], tuple[str, ...]]:
    """Return the parameters of each term, and what to know before believing them."""
    found, remarks, first = list[TermParameter](), list[str](), 0
    for one in model.placed:
        term, count, last = one.term, one.values.size, first + one.parameters.size
        own = covariance[first:last, first:last]
        first, errors = last, np.full(count + one.inner.size, np.nan)
        errors[np.append(np.ones(count, bool), one.free)] = np.sqrt(np.diag(own))
        unnamed = [(f"inner {i}", "1") for i in range(1, one.inner.size + 1)]
        names = [*((name, term.unit) for name in one.names), *(term.inner_names or unnamed)]
        values = [*one.values.tolist(), *one.inner.tolist()]
        rows = [
            TermParameter(term.asked, name, value, error, unit)
            for (name, unit), value, error in zip(names, values, errors.tolist(), strict=True)
        ]
        if term.muscle and count > 1:
            area, error = float(np.sum(one.values)), float(np.sqrt(np.sum(own)))
            size = of.FIR_SPACING_S * area, of.FIR_SPACING_S * error
            rows.append(TermParameter(term.asked, "gain", *size, "N·m·s/rad"))
        for row in rows:
            if row.name == "gain" and row.value < 0:
                remarks.append(
                    f"{row.term}: the gain is negative, {row.value:.3g} {row.unit}; a reflex "
                    "resists stretch, so this term explains something else"
                )
            if not np.isfinite(row.standard_error):
                where = "came to its bound" if row.value in (*term.low, *term.high) else "stays"
                remarks.append(
                    f"{row.term}: the {row.name} {where}, {row.value:.3g} {row.unit}; the data do "
                    "not determine it, and it has no error"
                )
        found += rows
    return tuple(found), tuple(remarks)


def _residual_test(motions: Motions, left: Sequence[Complex]) -> ResidualTest:
    """Test what is left against its own past, and against what moves the joint.

    ρ_k of the velocity is about normal with variance Σ r_e r_v / n (Bartlett), so that a coloured
    residual does not pass for a forgotten term.
    """
    zero = min(BARTLETT, *(int(moved.grid.line[-1]) // 4 for moved, _ in motions))
    lagged, count = np.zeros((3, 2 * zero + 1)), 0.0
    for (moved, _), residual in zip(motions, left, strict=True):
        v, grid = moved.lines[:, 1], moved.grid
        line = np.zeros((3, int(grid.line[-1]) + 1), np.complex128)
        line[:, grid.line] = np.abs(residual) ** 2, v.conj() * residual, np.abs(v) ** 2
        lagged += scipy.fft.irfft(line)[:, np.arange(-zero, zero + 1)]
        count += 2 * grid.line.size / grid.spread
    sizes = lagged[[0, 2], zero]
    own, cross, motion = lagged / np.array([[sizes[0], np.sqrt(np.prod(sizes)), sizes[1]]]).T
    lags = min(LAGS, zero)
    k = np.arange(1, lags + 1)
    q = count * (count + 2) * float(np.sum(own[zero + k] ** 2 / (count - k)))
    # Triangular weights keep the estimated variance positive.
    weights = 1 - np.abs(np.arange(-zero, zero + 1)) / (zero + 1)
    variance = max(float(np.sum(weights * own * motion)), 1e-3) / count
    near = cross[zero - lags : zero + lags + 1]
    largest = float(near[np.argmax(np.abs(near))])
    single = 2 * float(scipy.special.ndtr(-abs(largest) / np.sqrt(variance)))
    return ResidualTest(float(scipy.special.chdtrc(lags, q)), largest, min(1.0, single * near.size))


# --- Beside a free linear filter


def _freed(one: Problem) -> Problem:
    """Return what no linear filter of the motion makes of torque and columns, white."""
    seen = one.observation
    rows = np.vstack([seen.torque_nm, seen.motion.T, one.target, one.regressors.T])
    found = without_filter(seen.grid, rows)[4:]
    return Problem(found[1:].T, found[1:].T, found[0], seen)


def _beyond(row: ModelRow, model: _Sum) -> ModelRow:
    """Return the row with its bent terms beside a free filter, with inner ones of their own."""
    case, bent = model.case, [one.term for one in model.placed if one.term.asked in row.bent]
    white = [np.ones(one.grid.line.size) for one in case.observations]
    if not bent:
        problems = [_freed(one) for one in _no_columns(case.observations)]
        return replace(row, beyond_errors=_block_errors(problems, white))
    motions = [(one, one) for one in case.measured]
    free = _searched(_sum(bent, case, model.joint), motions, white, _freed)
    _, begin = _left([_freed(one) for one in free.problems(motions)], white)
    placed = [one._replace(free=one.inside) for one in free.at(begin).placed]
    free = free._replace(placed=placed)
    problems = [_freed(one) for one in free.problems(motions)]
    gram, moment = sums(problems)
    inverse = _inverse(gram)
    covariance = case.observations[0].grid.spread / 2 * inverse
    gains = _coefficients(_parameters(free.at(inverse @ moment), covariance)[0])
    return replace(row, beyond=gains, beyond_errors=_block_errors(problems, white))


def _no_columns(seen: Seen) -> list[Problem]:
    return [Problem(one.motion[:, :0], one.motion[:, :0], one.torque_nm, one) for one in seen]


def _coefficients(parameters: Iterable[TermParameter]) -> tuple[TermGain, ...]:
    return tuple(
        TermGain(one.term, one.value, one.standard_error, one.unit)
        for one in parameters
        if one.name in ("", "gain")
    )


def _gains(row: ModelRow) -> tuple[TermGain, ...]:
    """Return the coefficients of what is not linear, by the surest way there is."""
    every = row.fit.parameters if row.fit is not None else ()
    return row.beyond or _coefficients(one for one in every if one.term in row.bent)


# --- Models compared


def fit_models(observations: Seen, models: Sequence[Sequence[str]]) -> Comparison:
    """Fit each model to all of the data; none is recommended."""
    return Comparison(tuple(fit_model(observations, one) for one in models), None, "")


def compare_models(
    observations: Seen, models: Sequence[Sequence[str]], *, grow: bool = False, refused: str = ""
) -> Comparison:
    """Let each model predict blocks that it has not seen, and recommend one.

    Parameters
    ----------
    observations, models
        As for `fit_model`; the terms of each.
    grow : bool
        Add further terms to the best model, one by one, as long as that predicts better.
    refused : str
        Why none may be recommended (`refusal`).
    """
    count, before = max(len(models) - 1, 1), None
    single = dict.fromkeys(name for model in models for name in parse_terms(model))
    rows = [fit_model(observations, one) for one in models]
    while True:
        rows = _predicted(rows)
        chosen, reason = _recommended(rows, count)
        if not grow or chosen is None or not chosen.bent or chosen.terms == before:
            break
        before, known = chosen.terms, {frozenset(row.terms) for row in rows}
        taken = {*before, *(REFLEXES if {*before} & {*REFLEXES} else ())}
        further = [(*before, name) for name in single if name not in taken]
        rows += [fit_model(observations, one) for one in further if frozenset(one) not in known]
    if refused and chosen is not None:
        chosen, reason = None, refused
    return Comparison(tuple(rows), chosen, reason)


def refusal(fit: Fit) -> str:
    """Return why no model may be recommended for what `estimate` has a fit of, or an empty text."""
    reasons = [fit.outcome.reason] if fit.outcome.kind in ("excluded", "failed") else []
    reasons += [one.headline for one in fit.findings if one.name == "conditioning"]
    return f"none of these models is recommended for this epoch: {reasons[0]}" if reasons else ""


def better_clock(
    aligned: Seen, recorded: Seen, delay_s: float, models: Sequence[Sequence[str]]
) -> tuple[Seen, str]:
    """Return epochs on the clock on which the best of the models leaves less, and a remark.

    The delay of the torque is found with J, B and K alone, to which friction and a reflex look like
    one.
    """
    both = ((fit_model(seen, one).misfit for one in models) for seen in (aligned, recorded))
    moved, plain = map(min, both)
    if not plain < moved:
        return aligned, ""
    return recorded, (
        f"torque as recorded: J, B and K alone would have it {1e3 * delay_s:.2g} ms late, but "
        f"moved so these terms leave {np.exp(moved - plain):.2g} times as much of it"
    )


def _predicted(rows: Sequence[ModelRow]) -> list[ModelRow]:
    """Return the rows with the errors of their predictions; lines count alike in all."""
    best = min(rows, key=lambda row: row.misfit).fit
    if best is None:
        return list(rows)
    powers, found = best.solution.powers, []
    none = _no_columns([one.observation for one in best.solution.problems])
    offset = _block_errors(none, powers)
    for row in rows:
        if row.fit is not None:
            errors = _block_errors(row.fit.solution.problems, powers)
            problem = "; ".join(filter(None, map(_pushes, _gains(row))))
            row = replace(row, held_out=gain(offset, errors), errors=errors, problem=problem)
        found.append(row)
    return found


def _pushes(one: TermGain) -> str:
    """Return that what resists pushes, by more than chance; empty where it does not."""
    term = _known()[one.term]
    if one.value >= -2 * one.standard_error or not term.resists:
        return ""
    return (
        f"the gain of {one.term} is {one.value:.3g} ± {one.standard_error:.2g} {one.unit}: it "
        f"pushes, and a {term.label} resists, so it stands for something else"
    )


def _block_errors(problems: Sequence[Problem], powers: Powers) -> Array:
    """Return the squared errors of the prediction of each block, shape (b,).

    Each is predicted by a fit to the others, without `trim_s` at each side of it, at most a block;
    means are of no account.
    """
    p, parts, found = problems[0].regressors.shape[1], [], []
    for one, power in zip(problems, powers, strict=True):
        grid = one.observation.grid
        lines: Complex = np.vstack([one.instruments.T, one.regressors.T, one.target])
        parts.append(grid.in_time(lines * (grid.line > 0) / np.sqrt(power)))
    whole = sum(part[:p] @ part[p:].T for part in parts)
    for part, one in zip(parts, problems, strict=True):
        t, duration_s = part.shape[1], one.observation.grid.duration_s
        blocks = min(max(round(duration_s / BLOCK_S), FEWEST_BLOCKS), MOST_BLOCKS)
        edges = np.linspace(0, t, blocks + 1).astype(int)
        gap = min(round(one.observation.settings.estimation.trim_s * t / duration_s), int(edges[1]))
        for start, stop in pairwise(edges):
            near = part[:, max(start - gap, 0) : stop + gap]
            seen = whole - near[:p] @ near[p:].T
            values = _inverse(seen[:, :p]) @ seen[:, p]
            found.append(np.sum((part[-1, start:stop] - values @ part[p:-1, start:stop]) ** 2))
    return np.asarray(found)


def _inverse(gram: Array) -> Array:
    """Return the inverse; columns that are alike share what they explain."""
    if not gram.size:
        return gram
    size = np.sqrt(np.maximum(np.abs(np.diag(gram)), np.finfo(np.float64).tiny))
    return np.asarray(np.linalg.pinv(gram / np.outer(size, size), ALIKE) / np.outer(size, size))


def gain(smaller: Array, larger: Array, comparisons: int = 1) -> Gain:
    """Return what the larger model predicts better.

    Parameters
    ----------
    smaller, larger : arrays, shape (b,)
        Errors in the blocks.
    comparisons : int
        The interval is one of so many that hold together with 95 % (Bonferroni).
    """
    total, rest, count = np.sum(smaller), np.sum(larger), smaller.size
    without = np.log(np.maximum((rest - larger) / (total - smaller), NOTHING))
    spread = np.sqrt((count - 1) / count * np.sum((without - np.mean(without)) ** 2))
    half = float(scipy.special.stdtrit(count - 1, 1 - 0.025 / comparisons) * spread)
    ratio = max(float(rest / total), NOTHING)
    return Gain(*(100 * (1 - ratio * float(np.exp(power))) for power in (0.0, half, -half)))


def _more(smaller: ModelRow, larger: ModelRow, comparisons: int) -> Gain:
    if smaller.bent == larger.bent or not larger.beyond_errors.size:
        return gain(smaller.errors, larger.errors, comparisons)
    return gain(smaller.beyond_errors, larger.beyond_errors, comparisons)


def _recommended(rows: Sequence[ModelRow], count: int) -> tuple[ModelRow | None, str]:
    """Return the model to use, and why."""
    fitted = [row for row in rows if row.held_out is not None]
    if not fitted:
        return None, "no model could be fitted"
    # A larger model has to be better than the smallest, whether or not that explains enough.
    sound = [row for row in fitted if not row.problem]
    *before, chosen = _climbed(sound or fitted, count)
    none, held_out = "none of these models explains this torque: ", chosen.held_out
    assert held_out is not None  # it is fitted
    if chosen.problem:
        return None, none + chosen.problem
    if not held_out.beats(LEAST_PERCENT):
        return None, none + (
            f"the best, {chosen.name}, predicts {held_out.text} of its variance in blocks "
            f"that it has not seen; it must be {LEAST_PERCENT:g} % and its interval above 0"
        )
    for rival in fitted:
        if rival.problem and (far := _more(chosen, rival, count)).beats(FAR_PERCENT):
            return None, (
                f"{none}{rival.name} predicts {far.text} of what {chosen.name} leaves, but "
                f"{rival.problem}"
            )
    reason = (
        f"{chosen.name}: predicts {held_out.text} of the torque's variance in blocks that it "
        "has not seen"
    )
    for smaller in before[-1:]:
        free = chosen.beyond and smaller.bent != chosen.bent
        reason += (
            f", and {_more(smaller, chosen, count).text} of what {smaller.name} leaves"
            f"{' beyond any linear loop' if free else ''}"
        )
    return chosen, reason


def _climbed(rows: Sequence[ModelRow], count: int) -> list[ModelRow]:
    """Return the smallest model, and larger ones that predict better than the one before."""
    path = [min(rows, key=lambda row: (row.size, -row.held_out_vaf_percent))]
    while True:
        gains = [(row, _more(path[-1], row, count)) for row in rows if row.size > path[-1].size]
        better = [(row, more) for row, more in gains if more.beats(MARGIN_PERCENT)]
        if not better:
            return path
        best, _ = max(better, key=lambda pair: pair[1].percent)
        alike = [one for one in better if not _more(one[0], best, count).beats(MARGIN_PERCENT)]
        path.append(min(alike, key=lambda pair: (pair[0].size, -pair[1].percent))[0])
