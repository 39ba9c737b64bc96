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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.analysis.estimate_anew.grid import Array, Complex, Grid

SQRT2 = np.sqrt(2.0)
SMOOTH = 0.12
"""Of the RMS of the caused velocity: within so much of zero the instrument of friction turns. The
best instrument of a jump is smooth where the caused velocity is not quite the true one."""

DEGREE, HARMONICS, PARTS = 3, 2, 10


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

    def of(self, values: Array, window: Array | None = None) -> Complex:
        """Return the lines of coarse samples, behind the filter of the torque."""
        return np.asarray(self.grid.coarse_lines(values, window) * self.through)


Columns = Callable[[Motion, Array], Complex]


class Term(NamedTuple):
    """One term.

    Attributes
    ----------
    name, unit, label : str
        What it is called here and in words, and the unit of its coefficient.
    columns : callable
        From a motion and inner parameters, shape (d,), to lines, shape (q, m).
    inner : array, shape (k, d)
        Where the inner parameters are looked for.
    first : array, shape (t, d)
        With which of them it is tested.
    steps, low, high : array, shape (d,)
        For their slopes, and their bounds; a parameter with step 0 stays where it was found.
    bent : callable, optional
        From a motion and inner parameters to the motion of the joint and the torque at it.
    own : bool
        Each epoch has coefficients of its own.
    resists : bool
        A negative coefficient is something else.
    linear : bool
        In the motion: what a free linear filter would explain as well.
    muscle : bool
        Of a person.
    finding, asked : str
        The kind of its finding, and what `rigidimeter model --terms` calls it.
    tested : bool
        Without being asked for.
    parameter : int, optional
        Which of J, B and K a term without columns has for each epoch.
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
    bent: Callable[[Motion, Array], Motion] | None = None
    own: bool = False
    resists: bool = False
    linear: bool = False
    muscle: bool = False
    finding: str = "missing_term"
    asked: str = ""
    tested: bool = True
    parameter: int | None = None

    def __hash__(self) -> int:
        return hash(self.name)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Term) and self.name == other.name

    def slopes(self, motion: Motion, inner: Array, moving: NDArray[np.bool_]) -> Complex:
        """Return the column's slopes by the inner parameters that move, shape (d, m)."""
        found = []
        for one in np.diag(self.steps)[moving]:
            change = self.columns(motion, inner + one) - self.columns(motion, inner - one)
            found.append(change[0] / (2 * one.sum()))
        return np.stack(found)


def late(motion: Motion, values: Array, delay_s: float) -> Complex:
    """Return the lines of x(t − τ): w(t) x(t − τ) is x through the window w(t + τ)."""
    parts = motion.of(values, motion.grid.coarse_window)
    turn = np.exp(-1j * motion.grid.omega_rad_s * delay_s)
    return np.asarray(turn * (parts[0] + delay_s * parts[1] + delay_s**2 / 2 * parts[2]))


def _of(function: Callable[[Array, Array], Array]) -> Columns:
    """Return the column of a function of velocity and angle."""
    return lambda m, inner: m.of(function(m.velocity, m.angle))[None]


def _friction(motion: Motion, inner: Array) -> Complex:
    width = inner[0]
    if not motion.measured:
        width = max(width, SMOOTH * float(np.sqrt(np.mean(motion.velocity**2))))
    return motion.of(np.tanh(motion.velocity / width))[None]


def _by_sign(motion: Motion, inner: Array) -> Complex:
    """Return q ln cosh(θ/q): |θ| with a bend as wide as q."""
    x = np.abs(motion.angle) / inner[0]
    return motion.of(inner[0] * (x + np.log1p(np.exp(-2 * x))))[None]


def _reflex(function: Callable[[Array], Array]) -> Columns:
    def columns(motion: Motion, inner: Array) -> Complex:
        """Return the stretch velocity behind a delay and a critically damped muscle."""
        delay_s, lag_s = inner
        muscle = 1 + 1j * motion.grid.omega_rad_s * lag_s
        return (late(motion, function(motion.velocity), delay_s) / muscle**2)[None]

    return columns


def _times(motion: Motion, parameter: int, factor: Array, slope: Array) -> Complex:
    """Return the column of J, B or K times a slow function of time: another window."""
    w, dw, _ = motion.grid.coarse_window
    if parameter == 2:
        return motion.of(motion.angle, w * factor)
    found = motion.of(motion.velocity, w * factor)
    if parameter == 1:
        return found
    turning = motion.of(motion.velocity, dw * factor + w * slope)
    return np.asarray(1j * motion.grid.omega_rad_s * found - turning)


def _over_time(parameter: int) -> Columns:
    def columns(motion: Motion, inner: Array) -> Complex:
        del inner
        count, length_s = motion.velocity.size, motion.grid.duration_s
        x = (2 * np.arange(count) + 1) / count - 1
        factors, k = over_time(x), 2 / length_s
        slopes = k * np.stack([np.ones(count), 3 * x, 7.5 * x**2 - 1.5])
        return _times(motion, parameter, factors, slopes)

    return columns


def over_time(x: Array) -> Array:
    """Return Legendre's polynomials of degree 1 to 3, shape (3, ...), at −1 to 1."""
    return np.stack([x, 1.5 * x**2 - 0.5, 2.5 * x**3 - 1.5 * x])


def _over_phase(parameter: int) -> Columns:
    def columns(motion: Motion, inner: Array) -> Complex:
        del inner
        assert motion.phase is not None  # offered where there is one
        rate = np.gradient(np.unwrap(motion.phase), motion.grid.step / motion.grid.rate_hz)
        order = np.repeat(np.arange(1, HARMONICS + 1), 2)[:, None]
        slopes = np.roll(over_phase(motion.phase).reshape(HARMONICS, 2, -1), 1, axis=1)
        slopes = slopes * np.array([-1.0, 1.0])[:, None]
        slopes = order * rate * slopes.reshape(2 * HARMONICS, -1)
        return _times(motion, parameter, over_phase(motion.phase), slopes)

    return columns


def over_phase(phase: Array) -> Array:
    """Return cosine and sine of two harmonics, shape (4, ...)."""
    return np.concatenate([[np.cos(h * phase), np.sin(h * phase)] for h in (1, 2)])


def _at_delay(motion: Motion, inner: Array) -> Motion:
    """Return the torque as much earlier: M(t + τ) is M through the window w(t − τ)."""
    s = 1j * motion.grid.omega_rad_s
    first, second = motion.torque[:, 0], motion.torque[:, 1]
    w1 = s * first - second
    w2 = motion.torque[:, 2] - s**2 * first + 2 * s * w1
    delay_s = inner[0] if motion.measured else 0.0
    moved = np.exp(s * delay_s) * np.stack(
        [first - delay_s * w1 + delay_s**2 / 2 * w2, second, motion.torque[:, 2]]
    )
    return motion._replace(torque=moved.T)


def _behind_filter(motion: Motion, inner: Array) -> Motion:
    """Return the torque before a Butterworth filter of second order: M + √2 T M' + T² M''."""
    lag_s = inner[0] if motion.measured else 0.0
    more = np.zeros_like(motion.torque)
    more[:, 0] = SQRT2 * lag_s * motion.torque[:, 1] + lag_s**2 * motion.torque[:, 2]
    s = 1j * motion.grid.omega_rad_s
    more[:, 1:] = motion.torque[:, 1:] * (SQRT2 * lag_s * s + lag_s**2 * s**2)[:, None]
    return motion._replace(torque=motion.torque + more)


def _give(motion: Motion, inner: Array) -> tuple[Complex, Complex]:
    """Return θ per torque of the cuff, and torque per θ of the joint behind it."""
    s = 1j * motion.grid.omega_rad_s
    J, B, K = motion.joint
    path = (J - inner[2]) * s**2 + B * s + K
    return inner[0] / (1 + s * inner[1]), path


def _behind_cuff(motion: Motion, inner: Array) -> Motion:
    """Return the motion behind a soft cuff: the limb is at θ − c (M − J₁ θ'') / (1 + λ s).

    J₁ is the inertia on the sensor's side of it. Where the limb does not take part, J₁ θ'' comes
    as if it did: the torque is less by J₁ (θ'' − that of the limb).
    """
    s, (give, path) = 1j * motion.grid.omega_rad_s, _give(motion, inner)
    if not motion.measured:
        limb = motion.lines / (1 + give * path)[:, None]
        torque = limb @ (motion.joint - [inner[2], 0, 0]) + inner[2] * motion.lines[:, 0]
        torque = torque[:, None] * np.stack([np.ones_like(s), s, s * s], axis=1)
    else:
        torque = motion.torque
        inertial = motion.lines[:, :1] * np.stack([np.ones_like(s), s, s * s], axis=1)
        through = torque - inner[2] * inertial
        limb = motion.lines - give[:, None] * through[:, ::-1]
    torque = torque.copy()
    torque[:, 0] -= inner[2] * (motion.lines[:, 0] - limb[:, 0])
    return motion._replace(lines=limb, torque=torque)


def _cuff(motion: Motion, inner: Array) -> Complex:
    """Return the slopes by c, λ and J₁, of the motion behind the cuff."""
    s, (give, path) = 1j * motion.grid.omega_rad_s, _give(motion, inner)
    J, B, K = motion.joint - [inner[2], 0, 0]
    # What goes through the cuff: M − J₁ θ''; where it is soft already, from the limb.
    through = motion.torque[:, 2] * J + motion.torque[:, 1] * B + motion.torque[:, 0] * K
    if inner[2]:
        through = path * (motion.lines @ [J, B, K])
    lagged = 1 + s * inner[1]
    by_inertia = give * path * (s**2 * motion.lines[:, 2]) * (2 + give * path)
    return np.stack([-through / lagged, s * give / lagged * through, by_inertia])


def any_linear(motion: Motion, inner: Array) -> Complex:
    """Return free complex factors of what J, B and K answer, in parts of the band."""
    del inner
    omega = motion.grid.omega_rad_s
    part = np.digitize(omega, np.geomspace(np.pi, omega[-1], PARTS + 1)[:-1])
    torque = motion.lines @ motion.joint
    own = np.stack([torque * (part == k) for k in np.unique(part)])
    return np.concatenate([own, 1j * own])


def weight(posture_rad: float) -> Term:
    """Return the term of a limb's weight that is not a stiffness, about a posture from hanging."""

    def beyond_stiffness(velocity: Array, angle: Array) -> Array:
        del velocity
        bent = np.sin(posture_rad + angle) - np.sin(posture_rad)
        return np.asarray(bent - angle * np.cos(posture_rad))

    return Term("weight", "N·m", "the limb's weight", _of(beyond_stiffness), asked="weight")


def hum(frequency_hz: float) -> Term:
    """Return the term of a line of the mains."""

    def columns(motion: Motion, inner: Array) -> Complex:
        del inner
        turn = 2 * np.pi * frequency_hz * motion.grid.time_s
        return motion.grid.lines(np.stack([np.cos(turn), np.sin(turn)]))[0]

    return Term("hum", "N·m", "hum", columns, own=True, tested=False)


_LAGS_S = np.array([1 / (2 * np.pi * hz) for hz in (1.5, 3.0, 5.0, 8.0, 15.0, 30.0)])
KERNELS = np.array(
    [(d, 0.0) for d in np.arange(0.025, 0.1501, 0.005)]
    + [(d, lag) for d in (0.025, 0.04, 0.055, 0.07, 0.09) for lag in _LAGS_S]
)
"""Delays of a reflex and lags of its muscle, in s."""

_REFLEX = {
    "inner": KERNELS,
    "first": np.array([(0.03, 0.0), (0.06, 0.0), (0.05, _LAGS_S[1])]),
    "steps": np.array([5e-4, 5e-4]),
    "low": np.array([0.015, 0.0]),
    "high": np.array([0.2, 0.2]),
    "muscle": True,
}
_WIDTHS = np.array([[0.001], [0.003], [0.01], [0.02], [0.03], [0.05], [0.1]])
_TAUS = {"inner": np.zeros((1, 1)), "first": np.zeros((1, 1))}
_UNITS = {"J": "kg·m²", "B": "N·m·s/rad", "K": "N·m/rad"}

ANY_LINEAR = Term("any linear", "1", "anything linear", any_linear, linear=True)
FILTER = Term(
    "filter", "s", "a filter of the torque",
    lambda m, inner: -SQRT2 * m.torque[None, :, 1],
    **_TAUS, low=np.array([0.0]), high=np.array([0.03]),
    bent=_behind_filter, resists=True, linear=True, finding="torque_delay", tested=False,
)  # fmt: skip
CUFF = Term(
    "cuff", "rad/(N·m)", "a soft coupling",
    lambda m, inner: _cuff(m, inner)[: 1 + bool(inner[0]) + bool(inner[2])],
    inner=np.array([(0.0, lag, 0.0) for lag in (0.0, 5e-4, 1e-3, 2e-3, 4e-3)]),
    first=np.zeros((1, 3)), low=np.array([0.0, 0.0, 0.0]), high=np.array([np.inf, 0.02, np.inf]),
    bent=_behind_cuff, resists=True, linear=True, asked="cuff",
)  # fmt: skip

TERMS: tuple[Term, ...] = (
    Term(
        "friction", "N·m", "friction", _friction, inner=_WIDTHS, first=np.array([[0.01]]),
        steps=np.array([1e-3]), low=np.array([1e-3]), high=np.array([0.2]),
        resists=True, asked="coulomb",
    ),
    Term(
        "damping by direction", "N·m·s/rad", "directional damping", _of(lambda v, x: np.abs(v)),
        asked="directional-damping",
    ),
    Term(
        "stiffness by direction", "N·m/rad", "directional stiffness",
        _of(lambda v, x: x * np.sign(v)), asked="directional-stiffness",
    ),
    Term(
        "stiffness by side", "N·m/rad", "stiffness that differs between sides", _by_sign,
        inner=np.array([[0.005], [0.02], [0.05]]), first=np.array([[0.02]]),
        steps=np.array([1e-3]), low=np.array([2e-3]), high=np.array([0.2]),
        finding="varying_with_angle", asked="stiffness-by-side",
    ),
    Term(
        "quadratic", "N·m/rad²", "one-sided stiffness", _of(lambda v, x: x**2),
        finding="varying_with_angle", asked="quadratic",
    ),
    Term(
        "cubic", "N·m/rad³", "cubic stiffness", _of(lambda v, x: x**3),
        finding="varying_with_angle", asked="cubic",
    ),
    Term("reflex+", "N·m·s/rad", "reflex", _reflex(lambda v: np.maximum(v, 0)), **_REFLEX,
         asked="reflex+"),
    Term("reflex-", "N·m·s/rad", "reflex", _reflex(lambda v: np.minimum(v, 0)), **_REFLEX,
         asked="reflex-"),
    Term("reflex", "N·m·s/rad", "reflex", _reflex(lambda v: v), **_REFLEX, linear=True,
         asked="reflex+,reflex-"),
    Term(
        "delay", "s", "a late torque", lambda m, inner: -m.torque[None, :, 1], **_TAUS,
        low=np.array([-0.05]), high=np.array([0.05]), bent=_at_delay, linear=True,
        finding="torque_delay",
    ),
    CUFF,
    *(
        Term(f"{p} over time", _UNITS[p], f"{p} that changes with time", _over_time(j), own=True,
             linear=True, finding="varying_with_time")
        for j, p in enumerate("JBK")
    ),
    *(
        Term(f"{p} over phase", _UNITS[p], f"{p} that changes with phase", _over_phase(j),
             linear=True, finding="varying_with_phase")
        for j, p in enumerate("JBK") if p != "J"
    ),
)  # fmt: skip
"""Code from outside the package may append its own."""
