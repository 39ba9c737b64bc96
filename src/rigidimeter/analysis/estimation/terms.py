"""What the torque may hold beside J, B and K: each term is one record.

    M = J θ'' + B θ' + K θ + Σ q C(motion, φ) + noise

`columns` makes the lines of C. Called with the measured motion they are regressors, called with the
motion that the perturbation alone causes they are instruments: that is all that a test, a fit and a
comparison need to know of a term. φ are inner parameters, such as the delay of a reflex.

A term that bends the model has no coefficient of its own: `bent` undoes to motion and torque what
it did to them, and the columns are the slopes by its inner parameters.

References: friction, Janot, Gautier and Brunot (EMPS benchmark); damping and stiffness by
direction, Park et al. 2011; cubic stiffness, Wigren and Schoukens 2013; reflex, Mirbagheri, Barbeau
and Kearney 2000.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product
from typing import Any, NamedTuple

import numpy as np
import scipy
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.grid import Array, Complex, Grid
from rigidimeter.core.records import PARAMETERS

SMOOTH = 0.12
"""Of the RMS of the caused velocity: within so much of zero the instrument of friction turns. The
best instrument of a jump is smooth where the caused velocity is not quite the true one."""

FIR_LAGS_S, FIR_SPACING_S = np.arange(0.04, 0.441, 0.02), 0.02
"""Of triangles that overlap. Before 40 ms no stretch reflex can act."""

SHIFTS = np.arange(1, 14) * (np.sqrt(5) - 1) / 2 % 1
"""Other times, as shares of the epoch: no multiples of the period of what repeats in it."""

FINELY, MEMORY_S = 4, 2.0
"""Samples for a coarse one, where a function jumps or bends; the past that a reflex answers."""

DEGREE, FINER_DEGREE, HARMONICS, MOVEMENT_HARMONICS, PARTS = 3, 9, 2, 6, 10
"""Of polynomials over time, and of those that are fitted beside once a change is known: no other
term shall be found in what a few leave of it; of a phase; of a movement; parts of the
band for what has no name."""


class Motion(NamedTuple):
    """A motion and the torque that it meets.

    Attributes
    ----------
    grid : Grid
    velocity, angle : array, shape (c,)
        Coarse samples; the angle is that from its mean.
    lines : complex array, shape (m, 3)
        Of acceleration, velocity and angle.
    torque : complex array, shape (m, 3)
        Lines of M, M', M''; of a caused motion what J, B and K answer it with.
    joint : array, shape (3,)
        J, B and K at which the model is linearised.
    through : complex array, shape (m,), or 1
        The filter of the torque that the settings name.
    measured : bool
        Whether it is not the caused one.
    phase : array, shape (c,), optional
        Of an imposed movement, in rad.
    unseen : complex array, shape (m, 3), or 0
        What `lines` hold of the motion between the samples, as a torque that follows at once sees.
    every : array, shape (n,) or (0,)
        The velocity at all samples of the grid.
    zero : float
        The mean of the angle from the sensor's own zero.
    beside : array, shape (2, c), optional
        Velocity and angle that the perturbation does not cause, beside a caused motion.
    """

    grid: Grid
    velocity: Array
    angle: Array
    lines: Complex
    torque: Complex
    joint: Array
    through: Complex | float = 1.0
    measured: bool = True
    phase: Array | None = None
    unseen: Complex | float = 0.0
    every: Array = np.zeros(0)
    zero: float = 0.0
    beside: Array | None = None

    def of(self, values: Array, window: Array | None = None) -> Complex:
        """Return the lines of coarse samples, behind the filter of the torque."""
        return np.asarray(self.grid.coarse_lines(values, window) * self.through)


Columns = Callable[[Motion, Array], Complex]
Bend = Callable[[Motion, Array], Motion]


class Term(NamedTuple):
    """One term.

    Attributes
    ----------
    name, unit, label : str
        What it is called here, the unit of its coefficient, and what it is called in words.
    columns : callable
        From a motion and inner parameters, shape (k, d), to lines, shape (k q, m).
    inner, first : array, shape (k, d)
        Where inner parameters are looked for, and those with which the term is tested.
    steps, low, high : array, shape (d,)
        Of inner parameters, for slopes; and their bounds.
    bent : callable, optional
        From a motion and inner parameters, shape (d,), to the motion of the joint and its torque.
    parameter : int, optional
        Which of J, B and K a term has for each epoch: it needs no column.
    own : bool
        Each epoch has coefficients of its own.
    resists : bool
        A negative coefficient is something else.
    linear : bool
        A free linear filter of the motion would explain it, or a subject who follows the motion.
    muscle : bool
        Of a person.
    itself : bool
        The measured slopes by the inner parameters are their own instruments: those of a jump lie
        where the velocity is zero, which for the caused one is not quite the same time.
    finding, asked : str
        The kind of its finding, and what `rigidimeter model --terms` calls it; empty where that
        does not fit it.
    inner_names : tuple of (str, str)
        Names and units of inner parameters.
    tested : bool
        Without being asked for.
    """

    name: str
    unit: str
    label: str
    columns: Columns
    inner: Array = np.zeros((1, 0))
    first: Array = np.zeros((1, 0))
    steps: Array = np.zeros(0)
    low: Array = np.zeros(0)
    high: Array = np.zeros(0)
    bent: Bend | None = None
    parameter: int | None = None
    own: bool = False
    resists: bool = False
    linear: bool = False
    muscle: bool = False
    itself: bool = False
    finding: str = "missing_term"
    asked: str = ""
    inner_names: tuple[tuple[str, str], ...] = ()
    tested: bool = True

    def seen(self, motion: Motion, inner: Array) -> Complex:
        """Return the columns; as instruments, beside motion that the perturbation does not cause.

        Where the joint moves by c + u, c caused and u the rest, a term C(c + u) has the instrument

            D = C(c + u) − mean of C(c' + u),   c' what is caused, at other times.

        C(c) alone would be far from it: friction turns where c + u does. Noise that does not depend
        on when the perturbation comes is correlated with both parts of D alike, so not with D.
        """
        if motion.beside is None or not self.curved:
            return self.columns(motion, inner)
        caused, n = np.stack([motion.velocity, motion.angle]), motion.angle.size
        at_times = []
        for shift in (0.0, *SHIFTS):
            velocity, angle = motion.beside + np.roll(caused, round(shift * n), axis=1)
            at_times.append(self.columns(motion._replace(velocity=velocity, angle=angle), inner))
        return np.asarray(at_times[0] - np.mean(at_times[1:], axis=0))

    @property
    def curved(self) -> bool:
        """Whether it is no linear function of the motion, nor one that changes."""
        return not self.linear and self.finding in ("missing_term", "varying_with_angle")

    def with_slopes(self, motion: Motion, inner: Array, moving: NDArray[np.bool_]) -> Complex:
        """Return the columns, then their slopes by the inner parameters that move."""
        steps = np.diag(self.steps)[moving] if self.steps.size else np.zeros((0, inner.size))
        count = len(steps)
        found = self.seen(motion, np.concatenate([inner[None], inner + steps, inner - steps]))
        if not count:
            return found
        slopes = (found[1 : count + 1] - found[count + 1 :]) / (2 * steps.sum(axis=1))[:, None]
        return np.concatenate([found[:1], slopes])


def _of(*functions: Callable[[Array, Array], Array]) -> Columns:
    """Return the columns of functions of velocity and angle."""
    return lambda m, inner: m.of(np.stack([one(m.velocity, m.angle) for one in functions]))


def _friction(sign: int) -> Columns:
    def columns(motion: Motion, inner: Array) -> Complex:
        """Return tanh(v/w), of one side or, of sign 0, both: its jumps need every sample."""
        width, ends = inner[:, :1], (-float(sign <= 0), float(sign >= 0))
        if motion.every.size:
            rubs = np.clip(np.tanh(motion.every / width), *ends)
            return np.asarray(motion.grid.lines(rubs)[0] * motion.through)
        if not motion.measured:
            weight = motion.grid.coarse_window[0] ** 2
            width = width + SMOOTH * np.sqrt(motion.velocity**2 @ weight / weight.sum())
        return motion.of(np.clip(np.tanh(motion.velocity / width), *ends))

    return columns


def _of_joint(parameter: int) -> Columns:
    return lambda motion, inner: motion.lines.T[parameter][None]


def _by_side(motion: Motion, inner: Array) -> Complex:
    """Return q ln cosh((θ − θ₀)/q): |θ − θ₀| with a bend as wide as q."""
    x = np.abs(motion.angle - inner[:, 1:]) / inner[:, :1]
    return motion.of(inner[:, :1] * (x + np.log1p(np.exp(-2 * x))))


def _reflex(function: Callable[[Array], Array]) -> Columns:
    def columns(motion: Motion, inner: Array) -> Complex:
        """Return the stretch velocity behind a delay and a critically damped muscle.

        w(t) x(t − τ) is x through the window w(t + τ).
        """
        delay_s, lag_s = inner.T[:, :, None]
        s = 1j * motion.grid.omega_rad_s
        x, w = function(motion.velocity), motion.grid.coarse_window
        weight = w[0] ** 2
        parts = motion.of(x - x @ weight / weight.sum(), w)
        late = parts[0] + delay_s * parts[1] + delay_s**2 / 2 * parts[2]
        return np.asarray(np.exp(-s * delay_s) / (1 + s * lag_s) ** 2 * late)

    return columns


def _stretched(sign: int, gains: Callable[..., Complex]) -> Columns:
    """Return the columns of stretch of one side behind filters, functions of s and of φ."""
    rectified: Callable[[Array, float], Array] = np.maximum if sign > 0 else np.minimum

    def columns(motion: Motion, inner: Array) -> Complex:
        stretch, rate_hz = rectified(motion.velocity, 0.0), motion.grid.rate_hz / motion.grid.step
        past = min(stretch.size - 1, round(MEMORY_S * rate_hz))
        # The past is the mirror image; as many zeros keep the end from coming round to it.
        whole = np.concatenate([stretch[past:0:-1], stretch, np.zeros(past)])
        size = scipy.fft.next_fast_len(whole.size, real=True)
        s = 2j * np.pi * scipy.fft.rfftfreq(size, 1 / rate_hz)
        behind = scipy.fft.irfft(scipy.fft.rfft(whole, size) * gains(s, *inner.T[:, :, None]), size)
        return motion.of(behind[:, past : past + stretch.size])

    return columns


def _varying(parameter: int, factors: Callable[[Motion], Array]) -> Columns:
    def columns(motion: Motion, inner: Array) -> Complex:
        """Return J, B or K times slow functions of time: other windows."""
        del inner
        grid, factor = motion.grid, factors(motion)
        w, dw, _ = grid.coarse_window
        if parameter == 2:
            return motion.of(motion.angle, w * factor)
        found = motion.of(motion.velocity, w * factor)
        if parameter == 1:
            return found
        slope = np.gradient(factor, grid.step / grid.rate_hz, axis=1)
        turning = motion.of(motion.velocity, dw * factor + w * slope)
        return np.asarray(1j * grid.omega_rad_s * found - turning)

    return columns


def over_time(x: Array, first: int = 1, last: int = DEGREE) -> Array:
    """Return Legendre's polynomials of these degrees at −1 to 1, shape (last − first + 1, n)."""
    return np.asarray(legvander(x, last)[:, first:].T)


def over_phase(phase: Array, harmonics: int = HARMONICS) -> Array:
    """Return cosine and sine of the harmonics, shape (2 harmonics, n)."""
    of = [h * phase for h in range(1, harmonics + 1)]
    return np.concatenate([[np.cos(one), np.sin(one)] for one in of])


def _in_time(first: int, last: int) -> Callable[[Motion], Array]:
    return lambda motion: _over_samples(motion.velocity.size, first, last)


@lru_cache(maxsize=16)
def _over_samples(count: int, first: int, last: int) -> Array:
    return over_time((2 * np.arange(count) + 1) / count - 1, first, last)


def _movement(motion: Motion, inner: Array) -> Complex:
    """Return the torque that an imposed movement takes, as far as it repeats."""
    del inner
    assert motion.phase is not None  # offered where there is one
    return motion.of(over_phase(motion.phase, MOVEMENT_HARMONICS))


def _in_phase(motion: Motion) -> Array:
    assert motion.phase is not None  # offered where there is one
    return over_phase(motion.phase)


def _at_delay(motion: Motion, inner: Array) -> Motion:
    """Return the torque as much earlier: M(t + τ) is M through the window w(t − τ)."""
    if not motion.measured:
        return motion
    s, delay_s = 1j * motion.grid.omega_rad_s, inner[0]
    torque, first, second = motion.torque.T
    by_slope = s * torque - first
    by_bend = second - s**2 * torque + 2 * s * by_slope
    torque = torque - delay_s * by_slope + delay_s**2 / 2 * by_bend
    moved = np.exp(s * delay_s) * np.stack([torque, first, second])
    return motion._replace(torque=moved.T)


def _before_filter(motion: Motion, inner: Array) -> Motion:
    """Return the torque before a Butterworth filter of second order: M + √2 T M' + T² M''.

    Behind it nothing is left of what the motion does between the samples.
    """
    if not motion.measured:
        return motion
    s, lag_s = 1j * motion.grid.omega_rad_s, inner[0]
    torque, first, second = motion.torque.T
    torque = torque + np.sqrt(2) * lag_s * first + lag_s**2 * second
    passed = 1 + np.sqrt(2) * lag_s * s + lag_s**2 * s**2
    made = np.stack([torque, passed * first, passed * second], axis=1)
    return motion._replace(torque=made, lines=motion.lines - motion.unseen)


def _behind_cuff(motion: Motion, inner: Array) -> Motion:
    """Return the motion behind a soft coupling: the limb is at θ − c M / (1 + λ s)."""
    s = 1j * motion.grid.omega_rad_s
    give, powers = inner[0] / (1 + s * inner[1]), np.stack([np.ones_like(s), s, s * s], axis=1)
    if motion.measured:
        limb = motion.lines - motion.unseen - give[:, None] * motion.torque[:, ::-1]
        return motion._replace(lines=limb)
    limb = motion.lines / (1 + give * (powers[:, ::-1] @ motion.joint))[:, None]
    return motion._replace(lines=limb, torque=(limb @ motion.joint)[:, None] * powers)


def _cuff(motion: Motion, inner: Array) -> Complex:
    """Return the slopes by c and λ; that by λ only where there is a c."""
    s, (compliance, lag_s) = 1j * motion.grid.omega_rad_s, inner[0]
    through = motion.torque[:, ::-1] @ motion.joint / (1 + s * lag_s)
    if not compliance:
        return np.asarray(-through[None])
    return np.stack([-through, compliance * s / (1 + s * lag_s) * through])


def any_linear(motion: Motion, inner: Array) -> Complex:
    """Return free complex factors of what J, B and K answer, in parts of the band."""
    del inner
    omega, torque = motion.grid.omega_rad_s, motion.lines @ motion.joint
    part = np.digitize(omega, np.geomspace(np.pi, omega[-1], PARTS + 1)[:-1])
    own = np.stack([torque * (part == k) for k in np.unique(part)])
    return np.concatenate([own, 1j * own])


def _no_columns(motion: Motion, inner: Array) -> Complex:
    del inner
    return np.empty((0, motion.grid.line.size), dtype=np.complex128)


_LAGS_S = [1 / (2 * np.pi * hz) for hz in (1.5, 3.0, 5.0, 8.0, 15.0, 30.0)]
KERNELS = np.array(
    [(d, 0.0) for d in np.arange(0.025, 0.1501, 0.005)]
    + [(d, lag) for d in (0.025, 0.04, 0.055, 0.07, 0.09) for lag in _LAGS_S]
)
"""Delays of a reflex and lags of its muscle, in s."""

_UNITS = {one.symbol: one.unit for one in PARAMETERS}


def _reflex_of(name: str, asked: str, label: str, function: Callable[[Array], Array]) -> Term:
    return Term(
        name, "N·m·s/rad", label, _reflex(function), inner=KERNELS,
        first=np.array([(0.03, 0.0), (0.06, 0.0), (0.05, _LAGS_S[1])]),
        steps=np.array([5e-4, 5e-4]), low=np.array([0.015, 0.0]), high=np.array([0.2, 0.2]),
        muscle=True, linear=name == "reflex", resists=True, asked=asked,
    )  # fmt: skip


def _late(name: str, label: str, bent: Bend, low: float, high: float) -> Term:
    slope = np.sqrt(2) if name == "filter" else 1.0
    return Term(
        name, "s", label, lambda m, inner: -slope * m.torque[None, :, 1],
        inner=np.zeros((1, 1)), first=np.zeros((1, 1)), low=np.array([low]), high=np.array([high]),
        bent=bent, linear=True, resists=name == "filter", finding="torque_delay",
        tested=name == "delay",
    )  # fmt: skip


def _asked(
    name: str, unit: str, function: Callable[[Array, Array], Array], linear: bool = False
) -> Term:
    """Return the term of a function of velocity and of the angle from the sensor's zero.

    It is taken at finer samples: where it bends or jumps, its high harmonics would at the coarse
    ones come back as low ones.
    """

    def columns(motion: Motion, inner: Array) -> Complex:
        del inner
        both, n = np.stack([motion.velocity, motion.angle + motion.zero]), motion.angle.size
        # Behind it its mirror image, so that nothing jumps where the period closes.
        fine = scipy.signal.resample(np.hstack([both, both[:, ::-1]]), 2 * FINELY * n, axis=1)
        return motion.of(scipy.signal.resample(function(*fine), 2 * n)[:n])[None]

    return Term(name, unit, name, columns, linear=linear, asked=name)


def _asked_reflex(kind: str, sign: int) -> Term:
    unit, gains, tried, low, high, names = _REFLEXES[kind]
    name = kind + ("+" if sign > 0 else "-")
    return Term(
        name, unit, "reflex", _stretched(sign, gains), inner=np.array([*product(*tried)]),
        steps=1e-3 * (np.array(high) - low), low=np.array(low), high=np.array(high), resists=True,
        muscle=True, asked=name, inner_names=names,
    )  # fmt: skip


FRICTION = Term(
    "friction", "N·m", "friction", _friction(0), first=np.array([[0.02]]), inner=np.array([[0.02]]),
    steps=np.array([1e-3]), low=np.array([1e-3]), high=np.array([0.2]), resists=True, itself=True,
    asked="coulomb", inner_names=(("width", "rad/s"),),
)  # fmt: skip
BY_SIDE = Term(
    "stiffness by side", "N·m/rad", "stiffness that differs between sides", _by_side,
    inner=np.array([[0.01, 0.0], [0.04, 0.0]]), first=np.array([[0.02, 0.0]]),
    steps=np.array([1e-3, 1e-3]), low=np.array([2e-3, -0.1]), high=np.array([0.2, 0.1]),
    finding="varying_with_angle", asked="stiffness-by-side",
    inner_names=(("bend", "rad"), ("middle from the mean angle", "rad")),
)  # fmt: skip
MOVEMENT = Term("movement", "N·m", "", _movement, own=True, linear=True, finding="")
ANY_LINEAR = Term("any linear", "1", "anything linear", any_linear, linear=True, finding="")
FILTER = _late("filter", "a filter of the torque", _before_filter, 0.0, 0.03)
DELAY = _late("delay", "a delay", _at_delay, -0.05, 0.05)
CUFF = Term(
    "cuff", "rad/(N·m)", "a soft coupling", _cuff,
    inner=np.array([(0.0, lag) for lag in (0.0, 1e-3, 4e-3)]), first=np.zeros((1, 2)),
    low=np.zeros(2), high=np.array([np.inf, 0.02]), bent=_behind_cuff,
    resists=True, linear=True,
)  # fmt: skip
FINER = {
    f"{p} over time": Term(
        f"{p} over time, finer", unit, "", _varying(j, _in_time(DEGREE + 1, FINER_DEGREE)),
        own=True, linear=True, finding="",
    )
    for j, (p, unit) in enumerate(_UNITS.items())
}  # fmt: skip
"""What is fitted beside a change that was found."""

TERMS: list[Term] = [
    FRICTION,
    Term(
        "damping by direction", "N·m·s/rad", "directional damping", _of(lambda v, x: np.abs(v)),
        asked="directional-damping",
    ),
    Term(
        "stiffness by direction", "N·m/rad", "directional stiffness",
        _of(lambda v, x: x * np.sign(v)), asked="directional-stiffness",
    ),
    BY_SIDE,
    Term(
        "stiffness by angle", "N·m/rad²", "stiffness that goes with the angle",
        _of(lambda v, x: x * x, lambda v, x: x * x * x), finding="varying_with_angle",
        asked="quadratic,cubic",
    ),
    _reflex_of("reflex+", "reflex+", "a reflex to positive velocity", lambda v: np.maximum(v, 0)),
    _reflex_of("reflex-", "reflex-", "a reflex to negative velocity", lambda v: np.minimum(v, 0)),
    _reflex_of("reflex", "reflex+,reflex-", "a reflex", lambda v: v),
    DELAY,
    CUFF,
    *(
        Term(
            f"{p} over time", unit, f"{p} that changes", _varying(j, _in_time(1, DEGREE)),
            own=True, finding="varying_with_time",
        )
        for j, (p, unit) in enumerate(_UNITS.items())
    ),
    *(
        Term(
            f"{p} over phase", _UNITS[p], f"{p} that goes with the phase",
            _varying(j, _in_phase), finding="varying_with_phase",
        )
        for j, p in ((1, "B"), (2, "K"))
    ),
    *(
        Term(
            f"{p} between epochs", unit, f"{p} that differs between epochs", _no_columns,
            parameter=j, linear=True, finding="varying_between_epochs",
        )
        for j, (p, unit) in enumerate(_UNITS.items())
    ),
]  # fmt: skip
"""Code from outside the package may append its own."""

_DELAY = ("delay", "s")
_REFLEXES: dict[str, tuple[Any, ...]] = {
    "reflex": (
        "N·m·s/rad", lambda s, delay_s: np.exp(-s * delay_s),
        [np.arange(0.02, 0.301, 0.005).tolist()], [0.015], [0.31], (_DELAY,),
    ),
    "reflex-fir": (
        "N·m/rad", lambda s: np.exp(-s * FIR_LAGS_S[:, None]) * FIR_SPACING_S
        * np.sinc(s.imag / (2 * np.pi) * FIR_SPACING_S) ** 2,
        [], [], [], (),
    ),
    "reflex-second-order": (
        "N·m·s/rad", lambda s, delay_s, hz, ratio: np.exp(-s * delay_s)
        / (1 + ratio * s / (np.pi * hz) + (s / (2 * np.pi * hz)) ** 2),
        [(0.03, 0.045, 0.06, 0.08, 0.1, 0.13), (1.0, 2.0, 4.0, 8.0), (0.5, 1.0)],
        [0.015, 0.3, 0.2], [0.2, 20.0, 4.0],
        (_DELAY, ("natural frequency", "Hz"), ("damping ratio", "1")),
    ),
}  # fmt: skip
"""Unit, gains at s, inner parameters that are tried, their bounds, names and units."""

_SHARP = np.array([1e-4])
ASKED: list[Term] = [
    *(
        Term(one.title, one.unit, one.title, _of_joint(j), linear=True, asked=one.title)
        for j, one in enumerate(PARAMETERS)
    ),
    _asked("offset", "N·m", lambda v, x: np.ones_like(v), True),
    *(
        FRICTION._replace(
            columns=_friction(sign), inner=np.geomspace(1e-4, 0.1, 7)[:, None], low=_SHARP,
            steps=_SHARP / 2, asked=f"coulomb{name}",
        )
        for sign, name in ((0, ""), (1, "+"), (-1, "-"))
    ),
    _asked("quadratic", "N·m/rad²", lambda v, x: x**2),
    _asked("cubic", "N·m/rad³", lambda v, x: x**3),
    _asked("damping+", "N·m·s/rad", lambda v, x: np.maximum(v, 0)),
    _asked("damping-", "N·m·s/rad", lambda v, x: np.minimum(v, 0)),
    _asked("stiffness+", "N·m/rad", lambda v, x: x * (v > 0)),
    _asked("stiffness-", "N·m/rad", lambda v, x: x * (v < 0)),
    BY_SIDE._replace(
        columns=lambda m, inner: _by_side(m._replace(angle=m.angle - np.mean(m.angle)), inner),
        inner=np.array([*product((3e-3, 0.01, 0.03, 0.1), (0.0, -0.03, 0.03, -0.1, 0.1))]),
        low=np.array([1e-3, -1.0]), high=np.array([1.0, 1.0]), steps=np.array([5e-4, 1e-3]),
    ),
    *(_asked_reflex(kind, sign) for kind in _REFLEXES for sign in (1, -1)),
]  # fmt: skip
"""Terms that are fitted if they are asked for; nothing tests them."""
