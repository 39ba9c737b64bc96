"""The torque as a sum of named terms: fitted, compared, the right one recommended.

    M = Σ c C(motion, φ) + noise

`terms` has columns C; those that are fitted only if they are asked for are here. They are solved as
J, B and K are (`solve`): at the lines, with what the perturbation causes as the instruments where
it was recorded, so that torque of the subject's own does not bias them. Where the robot gives way
to torque, each line counts by its noise: else what the subject does comes back as motion. Where
nothing says so, all count alike, which is least squares in time (Parseval): what is left is then
mostly misfit, and as noise it would hide the slow lines that tell viscous from dry friction. Inner
parameters φ, as the delay of a reflex, are scanned, then solved as the coefficients of c ∂C/∂φ:
errors hold that both are not known (Golub and Pereyra 2003; Young and Jakeman 1979).

Models are compared by what they predict of blocks of about 1 s that they were not fitted to, each
line by its noise. Two of them by the ratio R of their squared errors, each block with its pair;
ln R has an interval by the jackknife over the blocks (Diebold and Mariano 1995). Without a
perturbation any linear term may follow the subject round the loop: terms that are not linear are
then compared by what no free linear filter of the motion explains.

A band from 0 Hz has one more line, that of the means: offset and friction of one side need it.

References: second-order reflex, Mirbagheri, Barbeau and Kearney 2000; halves by direction, Park et
al. 2011; whiteness, Ljung and Box 1978.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.grid import SAME_TIME, Array, Complex, Grid
from rigidimeter.analysis.estimation.methods import all_caused, direct, start_of
from rigidimeter.analysis.estimation.observation import Observation, torque_filter_of
from rigidimeter.analysis.estimation.published import least_squares
from rigidimeter.analysis.estimation.score import without_filter
from rigidimeter.analysis.estimation.signals import angle_at, values_at
from rigidimeter.analysis.estimation.solve import (
    Problem,
    Solution,
    noise_powers,
    shortest,
    solve,
    sums,
)
from rigidimeter.analysis.estimation.terms import SMOOTH, TERMS, Columns, Motion, Term
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Fit
from rigidimeter.core.settings import Settings
from rigidimeter.model import lowpass

JOINT = ("inertia", "damping", "stiffness")
REFLEX_INNER: dict[str, tuple[list[Sequence[float]], list[float], list[float]]] = {
    "reflex": ([np.arange(0.02, 0.301, 0.005).tolist()], [0.015], [0.31]),
    "reflex-fir": ([], [], []),
    "reflex-second-order": (
        [(0.03, 0.045, 0.06, 0.08, 0.1, 0.13), (1.0, 2.0, 4.0, 8.0), (0.5, 1.0)],
        [0.015, 0.3, 0.2], [0.2, 20.0, 4.0],
    ),
}  # fmt: skip
"""Where delay, frequency and damping are looked for, and their bounds."""

REFLEX_KINDS = tuple(REFLEX_INNER)
REFLEXES = tuple(kind + side for kind in REFLEX_KINDS for side in ("", "+", "-"))
"""`+` has the muscle stretched by motion toward positive angle, `-` the other; without a sign both
are tried, and the data decide."""

GROUPS = {
    f"directional-{one}": (f"{one}+", f"{one}-") for one in ("damping", "stiffness", "coulomb")
}
INNER = {
    "reflex": (("delay", "s"),),
    "reflex-second-order": (("delay", "s"), ("natural frequency", "Hz"), ("damping ratio", "1")),
    "coulomb": (("width", "rad/s"),),
    "stiffness-by-side": (("bend", "rad"), ("middle from the mean angle", "rad")),
}
"""Names and units of inner parameters."""

LEAST_PERCENT, MARGIN_PERCENT, FAR_PERCENT = 5.0, 1.0, 50.0
"""What a model must predict of the torque beyond an offset, and a larger one of the error of a
smaller. A rival that predicts so much of it, and may not be chosen, forbids the smaller."""

FIR_LAGS_S, FIR_SPACING_S = np.arange(0.04, 0.441, 0.02), 0.02
"""Of triangles that overlap. Before 40 ms no stretch reflex can act."""

FINER, MEMORY_S, FAINT, NEAR_BOUND = 4, 2.0, 0.01, 1e-3
"""Samples for a coarse one; of a reflex; of the window, where what was simulated rings; of the
range of a parameter."""

BLOCK_S, FEWEST_BLOCKS, MOST_BLOCKS = 1.0, 8, 24
LAGS, BARTLETT, MOST_TRIED = 20, 200, 150
NOTHING, ALIKE = 1e-12, 1e-8


def _reflex(kind: str, side: str) -> Term:
    """Return the stretch velocity after h: a delay, with a muscle of second order, or free."""
    rectified: Callable[[Array, float], Array] = np.maximum if side == "+" else np.minimum

    def columns(motion: Motion, inner: Array) -> Complex:
        stretch, rate_hz = rectified(motion.velocity, 0.0), motion.grid.rate_hz / motion.grid.step
        past = min(stretch.size - 1, round(MEMORY_S * rate_hz))
        # The past is the mirror image; as many zeros keep the end from coming round to it.
        whole = np.concatenate([stretch[past:0:-1], stretch, np.zeros(past)])
        size = scipy.fft.next_fast_len(whole.size, real=True)
        frequency_hz = scipy.fft.rfftfreq(size, 1 / rate_hz)
        lags_s = FIR_LAGS_S[:, None] if kind == "reflex-fir" else inner[:, :1]
        gains = np.exp(-2j * np.pi * frequency_hz * lags_s)
        if kind == "reflex-fir":
            gains = gains * FIR_SPACING_S * np.sinc(frequency_hz * FIR_SPACING_S) ** 2
        if kind == "reflex-second-order":
            ratio = frequency_hz / inner[:, 1:2]
            gains = gains / (1 - ratio**2 + 2j * inner[:, 2:] * ratio)
        passed = scipy.fft.irfft(scipy.fft.rfft(whole, size) * gains, size)
        return motion.of(passed[:, past : past + stretch.size])

    tried, low, high = REFLEX_INNER[kind]
    return Term(
        kind + side, "N·m/rad" if kind == "reflex-fir" else "N·m·s/rad", "reflex", columns,
        np.array([*product(*tried)]), steps=1e-3 * (np.array(high) - low), low=np.array(low),
        high=np.array(high), resists=True, muscle=True, asked=kind + side,
    )  # fmt: skip


def _plain(
    name: str, unit: str, columns: Callable[[Motion], Complex], linear: bool = False
) -> Term:
    return Term(name, unit, name, lambda m, inner: columns(m)[None], linear=linear, asked=name)


def _finely(motion: Motion, function: Callable[[Array, Array], Array]) -> Complex:
    """Return the lines of a function of velocity and angle that jumps or bends.

    It is taken at finer samples: at the coarse ones its high harmonics would come back as low ones.
    """
    both = np.stack([motion.velocity, motion.angle])
    n = both.shape[1]
    # Behind it its mirror image, so that nothing jumps where the period closes.
    fine = scipy.signal.resample(np.hstack([both, both[:, ::-1]]), 2 * FINER * n, axis=1)
    return motion.of(scipy.signal.resample(function(*fine), 2 * n, axis=-1)[..., :n])


def _rubs(sign: int) -> Term:
    """Return dry friction while the joint moves toward one side; of sign 0 toward both."""

    def columns(motion: Motion, inner: Array) -> Complex:
        width = inner[:, :1]
        if not motion.measured:
            # The best instrument of a jump is smooth where the caused velocity is not the true one.
            width = width + SMOOTH * float(np.sqrt(np.mean(motion.velocity**2)))
        toward = -float(sign <= 0), float(sign >= 0)
        return _finely(motion, lambda v, x: np.clip(np.tanh(v / width), *toward))

    name, low, high = "coulomb" + ["", "+", "-"][sign], np.array([1e-4]), np.array([0.2])
    return Term(
        name, "N·m", "friction", columns, np.geomspace(1e-4, 0.1, 7)[:, None], steps=low / 2,
        low=low, high=high, resists=True, asked=name,
    )  # fmt: skip


ASKED: list[Term] = [
    _plain("inertia", "kg·m²", lambda m: m.lines[:, 0], True),
    _plain("damping", "N·m·s/rad", lambda m: m.lines[:, 1], True),
    _plain("stiffness", "N·m/rad", lambda m: m.lines[:, 2], True),
    _plain("offset", "N·m", lambda m: m.of(np.ones_like(m.velocity)), True),
    *(_rubs(sign) for sign in (0, 1, -1)),
    _plain("quadratic", "N·m/rad²", lambda m: m.of(m.angle**2)),
    _plain("cubic", "N·m/rad³", lambda m: m.of(m.angle**3)),
    _plain("damping+", "N·m·s/rad", lambda m: _finely(m, lambda v, x: np.maximum(v, 0))),
    _plain("damping-", "N·m·s/rad", lambda m: _finely(m, lambda v, x: np.minimum(v, 0))),
    _plain("stiffness+", "N·m/rad", lambda m: _finely(m, lambda v, x: x * (v > 0))),
    _plain("stiffness-", "N·m/rad", lambda m: _finely(m, lambda v, x: x * (v < 0))),
    *(_reflex(kind, side) for kind in REFLEX_KINDS for side in "+-"),
]
"""Terms that are fitted if they are asked for. Code from outside the package may append its own."""


def _known() -> dict[str, Term]:
    """Return them by name, with those of `terms` that have one name and do not bend the model."""
    own = {one.asked: one for one in ASKED}
    return own | {
        one.asked: one._replace(columns=partial(_from_mean, one.columns))
        for one in TERMS
        if one.asked and not {one.asked, ","} & {*own, *GROUPS, *one.asked} and one.bent is None
    }


def _scaled(term: Term, motions: Motions) -> Term:
    """Return a term whose bend is sought inside the motion: beside it there is none."""
    if term.asked != "stiffness-by-side":
        return term
    sd_rad = float(np.sqrt(np.mean([np.var(own.angle) for _, own in motions])))
    tried = sd_rad * np.array([*product((0.1, 0.4), (0.0, -0.5, 0.5))])
    steps, low, high = sd_rad * np.array([[0.01, 0.01], [0.02, -1.0], [1.0, 1.0]])
    return term._replace(inner=tried, steps=steps, low=low, high=high)


def _from_mean(columns: Columns, motion: Motion, inner: Array) -> Complex:
    """Return the columns of a term of `terms`, whose angle is that from its mean."""
    return columns(motion._replace(angle=motion.angle - np.mean(motion.angle)), inner)


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
    found: list[str] = []
    for single in (one for name in names for one in GROUPS.get(name, (name,))):
        if single not in REFLEXES and single not in _known():
            known = f"known: {', '.join(term_names())}"
            if single.startswith("reflex"):
                known = (
                    f"a reflex is one of {', '.join(REFLEX_KINDS)}, followed by + or - for the "
                    "direction of motion that stretches the muscle, or by nothing to let the data "
                    "decide"
                )
            raise UserError(f"{where}there is no term {single!r}; {known}")
        if single in found:
            raise UserError(f"{where}{single} is named twice; name each term once")
        found.append(single)
    signs = [name[len(name.rstrip("+-")) :] for name in found if name in REFLEXES]
    if len(signs) > 1 and sorted(signs) != ["+", "-"]:
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
        Its columns belong to `columns`, then to inner parameters.
    columns : list of (str, str)
        Term and name of each coefficient.
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
    columns: list[tuple[str, str]]

    def of(self, name: str) -> TermParameter:
        """Return a parameter by `term`, or by `term name` where a term has several."""
        return next(p for p in self.parameters if name in (p.term, f"{p.term} {p.name}"))

    @property
    def misfit(self) -> float:
        """N · mean ln S."""
        return self.aic - 2 * self.n_parameters


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
    freed : sequence of Problem
        What no linear filter of the motion makes of torque and these terms, white.
    errors, beyond_errors : array, shape (b,)
        Of the prediction of each block.
    """

    terms: tuple[str, ...]
    fit: TermsFit | None
    held_out: Gain | None = None
    beyond: tuple[TermGain, ...] = ()
    problem: str = ""
    freed: Sequence[Problem] = field(default=(), repr=False)
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
    """A grid whose first line is that of the means, which counts as the others."""

    @property
    def size(self) -> float:
        """The first line over the mean: of white noise it has, being real, half a line."""
        return float(np.sqrt(self.time_s.size * self.energy / 2))

    def coarse_lines(self, values: Array, window: Array | None = None) -> Complex:
        """Return the lines, and the means before them."""
        w, found = self.coarse_window[0], super().coarse_lines(values, window)
        found[..., 0] = self.size * (values @ (w * (w if window is None else window)).T) / (w @ w)
        return found


def from_zero(settings: Settings, high_hz: float) -> Settings:
    """Return settings by which epochs are observed in a band that begins at 0 Hz."""
    edges = {"band_low_hz": 0.0, "band_high_closed_loop_hz": high_hz}
    estimation = settings.estimation.model_copy(update=edges)
    return settings.model_copy(update={"estimation": estimation})


def _with_means(one: Observation) -> Observation:
    """Return an epoch with the line of the means, where its band begins at 0 Hz."""
    if one.settings.estimation.band_low_hz > 0:
        return one
    (w, slope, _), old = one.grid.coarse_window, one.grid
    line, constant = np.append(0, old.line), np.append(np.sum(old.window[0]), old.constant)
    grid = _FromZero(**vars(old) | {"line": line, "constant": constant})
    torque = values_at(one.epoch.channels["torque_nm"], old.time_s, SAME_TIME)
    seen = _measured(replace(one, grid=grid), one.motion)
    both = seen.of(np.stack([seen.velocity, seen.angle]))[:, 0]
    turning = -2 * grid.size * (seen.velocity @ (w * slope)) / (w @ w)
    return replace(
        one, grid=grid, motion=np.vstack([np.append(turning, both), one.motion]), wider=None,
        torque_nm=np.append(grid.size * (torque @ old.window[0] ** 2) / old.energy, one.torque_nm),
        noise=None if one.noise is None else np.pad(one.noise, ((1, 0), (0, 0))),
    )  # fmt: skip


def _measured(one: Observation, lines: Complex) -> Motion:
    """Return the motion that was measured; its angle is from the sensor's own zero."""
    through: Complex | float = 1.0
    if (torque_filter := torque_filter_of(one.settings)) is not None:
        through = lowpass(np.asarray(1j * one.grid.omega_rad_s), *torque_filter)
    angle, epoch = one.coarse[1], one.epoch
    if "angle_rad" in epoch.channels:
        angle = angle + np.mean(angle_at(epoch, one.grid.time_s))
    return Motion(one.grid, one.coarse[0], angle, lines, lines, np.ones(3), through)


def _motions(seen: Seen, joint: Array) -> Motions:
    """Return the motion that is the instrument, and the measured one, of each."""
    if seen[0].cause is None:
        both = zip(seen, direct(seen, joint), strict=True)
        return [(_measured(o, p.instruments), _measured(o, p.regressors)) for o, p in both]
    found = []
    for one, caused in zip(seen, all_caused(seen, joint), strict=True):
        own, grid = _measured(one, one.motion), one.grid
        if isinstance(grid, _FromZero):
            lines = grid.coarse_motion(*caused.coarse)
            lines[0] = one.motion[0]
        else:
            lines = one.of_lines(caused.lines)
        velocity, angle = caused.coarse * (grid.coarse_window[0] > FAINT)
        angle = angle + np.mean(own.angle)
        cause = own._replace(velocity=velocity, angle=angle, lines=lines, measured=False)
        found.append((cause, own))
    return found


Seen = Sequence[Observation]
Motions = Sequence[tuple[Motion, Motion]]
"""What is the instrument, and what was measured, of each epoch."""


class _Model(NamedTuple):
    """A sum of terms as a pose: parameters are coefficients, then inner ones that are free.

    Attributes
    ----------
    terms : tuple of Term
        J, B and K first.
    joint : array, shape (3,)
        J, B and K of the loop, where they are no terms.
    inner : array, shape (d,)
        Of all terms in a row, where they are not free.
    free : array of bool, shape (d,)
    """

    terms: tuple[Term, ...]
    joint: Array
    inner: Array
    free: NDArray[np.bool_]

    def parts(self, values: NDArray[Any]) -> list[NDArray[Any]]:
        """Return what belongs to each term of something with a number for each inner parameter."""
        return np.split(values, np.cumsum([one.steps.size for one in self.terms])[:-1])

    def limit(self, inner: Array, within: float = 0.0) -> Array:
        """Return inner parameters inside their bounds, by so much of the range."""
        low, high = np.concatenate([[one.low, one.high] for one in self.terms], axis=1)
        return np.clip(inner, low + within * (high - low), high - within * (high - low))

    def rows(self, motion: Motion, inner: Array, values: Array) -> Complex:
        """Return the columns, then their slopes by inner parameters that are free."""
        columns, slopes = [], []
        for term, own, free in zip(self.terms, *map(self.parts, (inner, self.free)), strict=True):
            found = term.with_slopes(motion, own, free)
            last = len(found) - int(free.sum())
            columns.append(found[:last])
            slopes.append(values[sum(map(len, columns)) - 1] * found[last:])
        return np.concatenate([*columns, *slopes])

    def problems(self, seen: Seen, motions: Motions, values: Array) -> list[Problem]:
        """Return the problems at parameters, linearised where they are inner ones."""
        count, inner = values.size - int(self.free.sum()), self.inner.copy()
        inner[self.free] = values[count:]
        inner, problems = self.limit(inner), []
        for one, both in zip(seen, motions, strict=True):
            Z, X = (self.rows(motion, inner, values).T for motion in both)
            target = one.torque_nm + X[:, count:] @ inner[self.free]
            problems.append(Problem(Z, X, target, one))
        return problems

    def pose(self, seen: Seen, values: Array) -> list[Problem]:
        """Return the problems, with what the perturbation causes in a loop with their J, B, K."""
        at = [one.name for one in self.terms]
        both = zip(JOINT, self.joint, strict=True)
        joint = [values[at.index(name)] if name in at else known for name, known in both]
        return self.problems(seen, _motions(seen, np.array(joint)), values)


def _begun(terms: Sequence[Term], joint: Array) -> _Model:
    inner = np.concatenate([one.inner[0] for one in terms])
    return _Model(tuple(terms), joint, inner, np.zeros(inner.size, bool))


# --- One model


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
    try:
        if not free:
            return _fitted(seen, terms)
        both = [_fitted(seen, tuple(t + side * (t == free) for t in terms)) for side in "+-"]
    except ValueError as error:
        return ModelRow(terms, None, problem=str(error))
    # Of max(v, 0) and min(v, 0) the linear half is the same: what is left tells them apart.
    pushes = [next(one.value < 0 for one in _gains(row) if one.term[:-1] == free) for row in both]
    misfit = [row.fit.misfit if row.fit else np.inf for row in both]
    better, worse = both if (pushes[0], misfit[0]) < (pushes[1], misfit[1]) else both[::-1]
    vaf = [row.fit.vaf_percent if row.fit else np.nan for row in (better, worse)]
    remark = (
        f"{free}: the data decided for stretch by motion toward "
        f"{'positive' if better is both[0] else 'negative'} angle (VAF {vaf[0]:.2f} %, the other "
        f"direction {vaf[1]:.2f} %)"
    )
    fit = better.fit and better.fit._replace(remarks=(remark, *better.fit.remarks))
    return replace(better, fit=fit)


def _fitted(seen: Seen, names: tuple[str, ...]) -> ModelRow:
    """Fit one model whose terms are decided; ValueError says why not."""
    known, joint = _known(), start_of(seen)
    powers: Sequence[Array] = [np.full(one.grid.line.size, one.grid.energy) for one in seen]
    alike = seen[0].loop is None
    try:
        alone = _begun([known[one] for one in JOINT], joint)
        solution = solve(seen, alone.pose, joint, powers if alike else None)
        joint, powers = solution.values, solution.powers
    except ValueError:
        pass  # the terms may do without one of J, B and K
    motions = _motions(seen, joint)
    in_order = sorted(names, key=lambda one: one not in JOINT)
    terms = tuple(_scaled(known[one], motions) for one in in_order)
    model = _begun(terms, joint)
    labels = []
    for term in terms:
        count = len(term.columns(motions[0][1], term.inner[:1]))
        several = [f"response {lag_s:.3f} s" for lag_s in FIR_LAGS_S]
        own = several if count > 1 and term.muscle else ["gain" if term.muscle else ""] * count
        labels += [(term.asked, one) for one in own]
    target = _real([one.torque_nm for one in seen])
    words = [" ".join(one).strip() for one in labels]
    if not np.any(target):
        raise ValueError("the torque is constant in the band")
    # From coarse samples all: to as many digits as columns that are alike agree then.
    rough = [(_roughly(cause), _roughly(own)) for cause, own in motions]
    problems = model.problems(seen, rough, np.zeros(len(words)))
    least_squares(_real([one.instruments for one in problems]), target, words)
    begin = least_squares(_real([one.regressors for one in problems]), target, words).values
    model = _searched(model, seen, motions, powers, [one for one, _ in labels])
    rest = _whitened(problems, powers, begin)
    model, solution = _settled(model, seen, begin, [rest * s for s in powers] if alike else None)
    row = _row(names, model, labels, solution)
    return row if seen[0].cause else _beyond(row, model, seen, motions)


def _searched(
    model: _Model,
    seen: Seen,
    motions: Motions,
    powers: Sequence[Array],
    terms: Sequence[str],
    of: Callable[[Problem], Problem] = lambda one: one,
) -> _Model:
    """Return the model with the inner parameters that leave least of problems made by `of`.

    `terms` are those of the columns.
    """
    inner = [i for i, one in enumerate(model.terms) if one.steps.size]
    for i in inner * min(len(inner), 2):
        term, parts = model.terms[i], model.parts(model.inner)
        problems = model.problems(seen, motions, np.zeros(len(terms)))
        search = _Search(term, terms.index(term.asked), motions, problems, powers, of)
        parts[i] = best = term.inner[int(np.argmin(search.left(term.inner)))]
        if best.size > 1:  # a valley that steps of the solution do not find
            parts[i] = scipy.optimize.minimize(
                search.at, best, method="Nelder-Mead", options={"maxfev": MOST_TRIED},
                bounds=scipy.optimize.Bounds(term.low, term.high),
            ).x  # fmt: skip
        model = model._replace(inner=np.concatenate(parts))
    return model


class _Search(NamedTuple):
    """What is left of the torque where a column of problems has other inner parameters."""

    term: Term
    place: int
    motions: Motions
    problems: list[Problem]
    powers: Sequence[Array]
    of: Callable[[Problem], Problem]

    def at(self, inner: Array) -> float:
        """Return it, for inner parameters of shape (d,)."""
        return self.left(inner[None])[0]

    def left(self, inner: Array) -> list[float]:
        """Return it for each row of inner parameters; more where the term would push."""
        rows = [[self.term.columns(motion, inner) for motion in both] for both in self.motions]
        found = []
        for k in range(len(inner)):
            for one, (Z, X) in zip(self.problems, rows, strict=True):
                one.instruments[:, self.place], one.regressors[:, self.place] = Z[k], X[k]
            problems = [self.of(one) for one in self.problems]
            values = shortest(*sums(problems, self.powers))
            remains = _whitened(problems, self.powers, values)
            found.append(remains * (1 + (values[self.place] < 0)))
        return found


def _roughly(motion: Motion) -> Motion:
    lines = motion.grid.coarse_motion(motion.velocity, motion.angle)
    if motion.grid.line[0] == 0:
        lines[0] = motion.lines[0]
    return motion._replace(lines=lines)


def _real(lines: Sequence[Complex]) -> Array:
    whole = np.concatenate(lines)
    return np.concatenate([whole.real, whole.imag])


def _settled(
    model: _Model, seen: Seen, begin: Array, powers: Sequence[Array] | None
) -> tuple[_Model, Solution]:
    """Return the model at its solution; inner parameters that the data do not tell are held."""
    free = model.limit(model.inner, NEAR_BOUND) == model.inner
    while True:
        model = model._replace(free=free)
        try:
            solution = solve(seen, model.pose, np.append(begin, model.inner[free]), powers)
        except ValueError:
            if not np.any(free):
                raise
            free = np.zeros_like(free)
            continue
        inner = model.inner.copy()
        inner[free] = solution.values[begin.size :]
        inside = model.limit(inner, NEAR_BOUND) == inner
        # What steps out of its bounds stays where it was found to leave least.
        model = model._replace(inner=np.where(inside, inner, model.inner))
        if np.all(inside[free]):
            return model, solution
        free = free & inside


def _row(
    names: tuple[str, ...], model: _Model, labels: list[tuple[str, str]], solution: Solution
) -> ModelRow:
    errors = np.full(model.inner.size, np.nan)
    errors[model.free] = solution.se[len(labels) :]
    found, remarks = [], []
    for term, inner, inner_se in zip(
        model.terms, model.parts(model.inner), model.parts(errors), strict=True
    ):
        at = [place for place, one in enumerate(labels) if one[0] == term.asked]
        for i in at:
            value, se = float(solution.values[i]), float(solution.se[i])
            found.append(TermParameter(*labels[i], value, se, term.unit))
        if term.muscle and len(at) > 1:
            area = FIR_SPACING_S * float(np.sum(solution.values[at]))
            se = FIR_SPACING_S * float(np.sqrt(np.sum(solution.covariance[np.ix_(at, at)])))
            found.append(TermParameter(term.asked, "gain", area, se, "N·m·s/rad"))
        if term.muscle and found[-1].value < 0:
            remarks.append(
                f"{term.asked}: the gain is negative, {found[-1].value:.3g} {found[-1].unit}; a "
                "reflex resists stretch, so this term explains something else"
            )
        unnamed = [(f"inner {i}", "1") for i in range(1, inner.size + 1)]
        kinds = INNER.get(term.asked.rstrip("+-"), unnamed)
        for (name, unit), value, se in zip(kinds, inner.tolist(), inner_se.tolist(), strict=True):
            found.append(TermParameter(term.asked, name, value, se, unit))
            if not np.isfinite(se):
                where = "came to its bound" if value in (*term.low, *term.high) else "stays"
                remarks.append(
                    f"{term.asked}: the {name} {where}, {value:.3g} {unit}; the data do not "
                    "determine it, and it has no error"
                )
    found.sort(key=lambda one: names.index(one.term))
    problems = solution.problems
    solution = replace(solution, powers=noise_powers(problems, solution.values))
    left = [one.residual(solution.values) for one in problems]
    grids = [one.observation.grid for one in problems]
    whole = _power([one.observation.torque_nm for one in problems])
    count, p = sum(2 * one.line.size / one.spread for one in grids), solution.values.size
    p += int(np.sum(~model.free))
    logs = [np.log(s / grid.energy) for s, grid in zip(solution.powers, grids, strict=True)]
    misfit = count * float(np.mean(np.concatenate(logs)))
    fit = TermsFit(
        tuple(found), p, 100 * (1 - _power(left) / whole), misfit + 2 * p,
        misfit + p * float(np.log(count)), count, solution.condition_number,
        _residual_test(problems, left, model.joint), tuple(remarks), solution, labels,
    )  # fmt: skip
    return ModelRow(names, fit)


def _whitened(problems: Sequence[Problem], powers: Sequence[Array], values: Array) -> float:
    """Return the mean of |r|²/S."""
    each = zip(problems, powers, strict=True)
    return float(np.mean(np.concatenate([np.abs(p.residual(values)) ** 2 / s for p, s in each])))


def _power(lines: Sequence[Complex]) -> float:
    return float(sum(np.vdot(one, one).real for one in lines))


def _residual_test(
    problems: Sequence[Problem], left: Sequence[Complex], joint: Array
) -> ResidualTest:
    """Test what is left against its own past, and against what moves the joint.

    ρ_k of the velocity is about normal with variance Σ r_e r_v / n (Bartlett), so that a coloured
    residual does not pass for a forgotten term.
    """
    seen = [one.observation for one in problems]
    last = min(int(one.grid.line[-1]) for one in seen)
    zero = min(BARTLETT, last // 4)
    lagged, count = np.zeros((3, 2 * zero + 1)), 0.0
    for (moved, _), one, residual in zip(_motions(seen, joint), seen, left, strict=True):
        v, line = moved.lines[:, 1], np.zeros((3, int(one.grid.line[-1]) + 1), np.complex128)
        line[:, one.grid.line] = np.abs(residual) ** 2, v.conj() * residual, np.abs(v) ** 2
        lagged += scipy.fft.irfft(line)[:, np.arange(-zero, zero + 1)]
        count += 2 * one.grid.line.size / one.grid.spread
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


def _gains(row: ModelRow) -> tuple[TermGain, ...]:
    """Return the coefficients of what is not linear, by the surest way there is."""
    if row.beyond or row.fit is None:
        return row.beyond
    return tuple(
        TermGain(one.term, one.value, one.standard_error, one.unit)
        for one in row.fit.parameters
        if one.term in row.bent and one.name in ("", "gain")
    )


def _freed(one: Problem) -> Problem:
    """Return what no linear filter of the motion makes of torque and columns, white."""
    seen = one.observation
    rows = np.vstack([seen.torque_nm, seen.motion.T, one.target, one.regressors.T])
    found = without_filter(seen.grid, rows)[4:]
    return Problem(found[1:].T, found[1:].T, found[0], seen)


def _beyond(row: ModelRow, model: _Model, seen: Seen, motions: Motions) -> ModelRow:
    """Return the row with its terms beside a free linear filter, with inner ones of their own."""
    if not row.bent or row.fit is None:
        none = [Problem(o.motion[:, :0], o.motion[:, :0], o.torque_nm, o) for o in seen]
        return replace(row, freed=[*map(_freed, none)])
    names = [name for name, _ in row.fit.columns if name in row.bent]
    model = _begun([one for one in model.terms if one.asked in names], model.joint)
    powers = [np.ones(one.grid.line.size) for one in seen]
    model = _searched(model, seen, motions, powers, names, _freed)
    values = shortest(*sums([*map(_freed, model.problems(seen, motions, np.zeros(len(names))))]))
    free = model.limit(model.inner, NEAR_BOUND) == model.inner
    model, values = model._replace(free=free), np.append(values, model.inner[free])
    problems = [*map(_freed, model.problems(seen, motions, values))]
    gram, moment = sums(problems)
    inverse = _inverse(gram)
    values, covariance = inverse @ moment, seen[0].grid.spread / 2 * inverse
    found = []
    for term in model.terms:
        at = [place for place, name in enumerate(names) if name == term.asked]
        width, unit = (FIR_SPACING_S, "N·m·s/rad") if len(at) > 1 else (1.0, term.unit)
        se = width * float(np.sqrt(np.sum(covariance[np.ix_(at, at)])))
        found.append(TermGain(term.asked, width * float(np.sum(values[at])), se, unit))
    return replace(row, beyond=tuple(found), freed=problems)


def _inverse(gram: Array) -> Array:
    """Return the inverse; columns that are alike share what they explain."""
    if not gram.size:
        return gram
    size = np.sqrt(np.maximum(np.abs(np.diag(gram)), np.finfo(np.float64).tiny))
    return np.asarray(np.linalg.pinv(gram / np.outer(size, size), ALIKE) / np.outer(size, size))


# --- Models compared


def fit_models(observations: Seen, models: Sequence[Sequence[str]]) -> Comparison:
    """Fit each model to all of the data; none is recommended."""
    return Comparison(tuple(fit_model(observations, one) for one in models), None, "")


def compare_models(
    observations: Seen,
    models: Sequence[Sequence[str]],
    *,
    grow: bool = False,
    refused: str = "",
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
    count = max(len(models) - 1, 1)
    rows = _predicted([fit_model(observations, one) for one in models])
    chosen, reason = _recommended(rows, count)
    single = dict.fromkeys(name for model in models for name in parse_terms(model))
    while grow and chosen is not None and chosen.bent:
        known = {frozenset(row.terms) for row in rows}
        kinds = {_kind(name) for name in chosen.terms}
        further = [(*chosen.terms, name) for name in single if _kind(name) not in kinds]
        new = [fit_model(observations, one) for one in further if frozenset(one) not in known]
        rows, before = _predicted([*rows, *new]), chosen.terms
        chosen, reason = _recommended(rows, count)
        if chosen is None or chosen.terms == before:
            break
    if refused and chosen is not None:
        return Comparison(tuple(rows), None, refused)
    return Comparison(tuple(rows), chosen, reason)


def _kind(name: str) -> str:
    """Return what of a name two terms of one model may not share."""
    return "reflex" if name in REFLEXES else name


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
    every = [[fit_model(seen, one).fit for one in models] for seen in (aligned, recorded)]
    moved, plain = (
        min((fit.misfit / fit.independent_samples for fit in fits if fit), default=np.inf)
        for fits in every
    )
    if not plain < moved:
        return aligned, ""
    return recorded, (
        f"torque as recorded: J, B and K alone would have it {1e3 * delay_s:.2g} ms late, but "
        f"moved so these terms leave {np.exp(moved - plain):.2g} times as much of it"
    )


def _predicted(rows: Sequence[ModelRow]) -> list[ModelRow]:
    """Return the rows with the errors of their predictions; lines count alike in all."""
    fits = [row.fit for row in rows if row.fit is not None]
    found = list(rows)
    for i, row in enumerate(rows):
        if row.fit is None:
            continue
        powers = min(fits, key=lambda one: one.misfit).solution.powers
        problems = row.fit.solution.problems
        errors, offset = _block_errors(problems, powers), _block_errors(problems, powers, none=True)
        caused = problems[0].observation.cause is not None
        beyond = errors
        if not caused:
            beyond = _block_errors(row.freed, [np.ones(one.target.size) for one in row.freed])
        found[i] = replace(
            row, held_out=gain(offset, errors), errors=errors, beyond_errors=beyond,
            problem="; ".join(filter(None, map(_pushes, _gains(row)))),
        )  # fmt: skip
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


def _block_errors(
    problems: Sequence[Problem], powers: Sequence[Array], *, none: bool = False
) -> Array:
    """Return the squared errors of the prediction of each block, shape (b,); `none`: by a mean.

    Each is predicted by a fit to the others, without `trim_s` at each side of it, at most a block.
    """
    p, parts, found = 0 if none else problems[0].regressors.shape[1], [], []
    for one, power in zip(problems, powers, strict=True):
        grid, target = one.observation.grid, one.observation.torque_nm if none else one.target
        lines = np.vstack([one.instruments.T[:p], one.regressors.T[:p], target])
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
    if smaller.bent == larger.bent:
        return gain(smaller.errors, larger.errors, comparisons)
    return gain(smaller.beyond_errors, larger.beyond_errors, comparisons)


def _recommended(rows: Sequence[ModelRow], count: int) -> tuple[ModelRow | None, str]:
    """Return the model to use, and why."""
    fitted = [row for row in rows if row.held_out is not None]
    if not fitted:
        return None, "no model could be fitted"
    # A larger model has to be better than the smallest, whether or not that explains enough.
    sound = [row for row in fitted if not row.problem]
    chosen, more, smaller = _climbed(sound or fitted, count)
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
    if more is None:
        return chosen, reason
    beyond = "" if smaller.bent == chosen.bent or not chosen.beyond else " beyond any linear loop"
    return chosen, f"{reason}, and {more.text} of what {smaller.name} leaves{beyond}"


def _climbed(rows: Sequence[ModelRow], count: int) -> tuple[ModelRow, Gain | None, ModelRow]:
    """Return the largest model that predicts better than those it was held against.

    With it what it gains over the one before it, None where it is the smallest.
    """
    chosen = smaller = min(rows, key=lambda row: (row.size, -row.held_out_vaf_percent))
    gained: Gain | None = None
    while True:
        better = [
            (row, more)
            for row in rows
            if row.size > chosen.size and (more := _more(chosen, row, count)).beats(MARGIN_PERCENT)
        ]
        if not better:
            return chosen, gained, smaller
        best, _ = max(better, key=lambda pair: pair[1].percent)
        alike = [one for one in better if not _more(one[0], best, count).beats(MARGIN_PERCENT)]
        smaller = chosen
        chosen, gained = min(alike, key=lambda pair: (pair[0].size, -pair[1].percent))
