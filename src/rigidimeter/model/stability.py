"""Whether the loop is stable with a joint in it, and how far it is from not being so.

The loop feeds the torque of the arm back into the motion of the arm. At high frequency the arm is
an inertia, and the open loop tends to J / J_c, rolled off by the torque filter and the drive and
turned by every delay: a light virtual inertia under a heavy arm oscillates. Read per radian, the
paper's J_c of 0.0008 kg·m² is a sixth of the arm's inertia, and the loop is unstable with the
paper's 20 Hz filter; read per degree it is ten times the arm's, and the loop is stable.

The verdict is exact: the largest eigenvalue of the loop over one pattern of sensor readings, drive,
filter, delays and hold included. The margins are those of L(jω) along the frequency axis:

- gain margin, 1/|L| where L is real and negative; below 0 dB the loop is already unstable;
- phase margin, 180° + arg L where |L| = 1, and delay margin, that phase over ω;
- modulus margin, the smallest |1 + L|: the distance to the point −1.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings
from rigidimeter.model.joint import JointDynamics, median_joint
from rigidimeter.model.linear_loop import Loop
from rigidimeter.model.loop_poles import spectral_radius
from rigidimeter.model.velocity_drive import Array, Complex

_POINTS = 4000
_LOWEST_HZ = 1e-3
_REFINEMENTS = 4
_STEADY = 1e-9
"""A loop whose largest eigenvalue is closer to 1 than this does not settle."""


@dataclass(frozen=True)
class Margins:
    """Stability of the loop with one joint.

    Attributes
    ----------
    joint : JointDynamics
    stable : bool
        Whether every disturbance dies out.
    spectral_radius : float
        By how much the slowest (or fastest growing) mode changes a tick.
    gain_margin_db, phase_margin_deg, delay_margin_s : float
        Infinite where the curve never crosses.
    modulus_margin : float
    gain_margin_hz, phase_margin_hz, delay_margin_hz, modulus_margin_hz : float
        Where each is found; NaN where the curve never crosses.
    """

    joint: JointDynamics
    stable: bool
    spectral_radius: float
    gain_margin_db: float
    gain_margin_hz: float
    phase_margin_deg: float
    phase_margin_hz: float
    delay_margin_s: float
    delay_margin_hz: float
    modulus_margin: float
    modulus_margin_hz: float


@dataclass(frozen=True)
class Stability:
    """The joints of the settings, and the worst of the joints around each.

    Attributes
    ----------
    conditions : dict of str to Margins
        With the median joint of each condition.
    worst : dict of str to Margins
        With the joint, among all combinations of the factors, that has the smallest modulus margin
        or is the most unstable.
    warnings : tuple of str
        A sentence for each condition that is nearly unstable, or may become unstable.
    """

    conditions: dict[str, Margins]
    worst: dict[str, Margins]
    warnings: tuple[str, ...]


def _frequencies_hz(settings: Settings) -> Array:
    """Return the frequencies along which the margins are looked for."""
    return np.geomspace(_LOWEST_HZ, settings.rig.tick_rate_hz / 2.0, _POINTS)


def loop_margins(settings: Settings, joint: JointDynamics) -> Margins:
    """Return stability and margins of the loop with a joint in it."""
    loop = Loop(settings.controller, settings.rig)

    def curve_at(frequency_hz: Array) -> Complex:
        return loop.at_frequency(frequency_hz).gain(joint.parameters)

    frequency = _frequencies_hz(settings)
    curve = curve_at(frequency)
    gain_db, gain_hz = math.inf, math.nan
    # The negative real axis is crossed where the imaginary part changes sign.
    for crossing, value in _crossings(lambda values: values.imag, curve_at, frequency, curve):
        if value.real < 0 and -20.0 * math.log10(abs(value)) < gain_db:
            gain_db, gain_hz = -20.0 * math.log10(abs(value)), crossing
    phase_deg, phase_hz, delay_s, delay_hz = math.inf, math.nan, math.inf, math.nan
    for crossing, value in _crossings(
        lambda values: np.abs(values) - 1, curve_at, frequency, curve
    ):
        ahead_deg = math.degrees(math.atan2(-value.imag, -value.real))
        if abs(ahead_deg) < abs(phase_deg):
            phase_deg, phase_hz = ahead_deg, crossing
        left_s = (ahead_deg % 360.0) / 360.0 / crossing
        if left_s < delay_s:
            delay_s, delay_hz = left_s, crossing
    radius = spectral_radius(settings, joint)
    stable = radius < 1.0 - _STEADY
    nearest = int(np.argmin(np.abs(1.0 + curve)))
    return Margins(
        joint=joint,
        stable=stable,
        spectral_radius=radius,
        gain_margin_db=gain_db,
        gain_margin_hz=gain_hz,
        phase_margin_deg=phase_deg,
        phase_margin_hz=phase_hz,
        # An unstable loop has no delay left to give.
        delay_margin_s=delay_s if stable else 0.0,
        delay_margin_hz=delay_hz,
        modulus_margin=float(np.abs(1.0 + curve[nearest])),
        modulus_margin_hz=float(frequency[nearest]),
    )


def loop_stability(settings: Settings) -> Stability:
    """Return the margins for each condition and for the worst joint around each."""
    conditions, worst = {}, {}
    loop = Loop(settings.controller, settings.rig).at_frequency(_frequencies_hz(settings))
    for name, subject in settings.subject.items():
        joint = median_joint(subject)
        conditions[name] = loop_margins(settings, joint)

        def badness(candidate: JointDynamics) -> tuple[float, float]:
            radius = spectral_radius(settings, candidate)
            unstable = radius if radius >= 1.0 - _STEADY else 0.0
            return unstable, -float(np.min(np.abs(1.0 + loop.gain(candidate.parameters))))

        worst[name] = loop_margins(settings, max(_around(settings, joint), key=badness))
    warnings = [
        sentence
        for name in conditions
        for what, margins in (
            (f"the loop with subject {name}", conditions[name]),
            (f"the loop with the worst joint around subject {name}", worst[name]),
        )
        for sentence in near_instability(what, margins, settings)
    ]
    return Stability(conditions, worst, tuple(warnings))


def near_instability(what: str, margins: Margins, settings: Settings) -> tuple[str, ...]:
    """Return a sentence where a loop is unstable, or its margins are below the thresholds.

    Parameters
    ----------
    what : str
        What loop, as the sentence begins.
    margins : Margins
    settings : Settings
        For the thresholds `margins.gain_margin_db` and `margins.phase_margin_deg`.
    """
    joint, wanted = margins.joint, settings.margins
    values = (
        f"J {joint.inertia_kg_m2:.3g} kg·m², B {joint.damping_nm_s_rad:.3g} N·m·s/rad, "
        f"K {joint.stiffness_nm_rad:.3g} N·m/rad"
    )
    if not margins.stable:
        return (f"{what} ({values}) is unstable",)
    found = (
        ("gain margin", margins.gain_margin_db, "dB", "gain_margin_db", wanted.gain_margin_db),
        (
            "phase margin",
            margins.phase_margin_deg,
            "deg",
            "phase_margin_deg",
            wanted.phase_margin_deg,
        ),
    )
    low = [
        f"a {name} of {value:.3g} {unit}, less than margins.{key} = {threshold:g} {unit}"
        for name, value, unit, key, threshold in found
        if value < threshold
    ]
    return (f"{what} ({values}) has {' and '.join(low)}",) if low else ()


def refuse_unstable(settings: Settings, stability: Stability | None = None) -> None:
    """Refuse settings whose loop is unstable, or nearly so, with the joint of a condition.

    Nearly means below `margins.gain_margin_db` or `margins.phase_margin_deg`.

    Raises
    ------
    UserError
        Naming the condition and what would help.
    """
    found = stability.conditions if stability else None
    for name, subject in settings.subject.items():
        margins = found[name] if found else loop_margins(settings, median_joint(subject))
        if not margins.stable:
            grows = math.log(margins.spectral_radius) * settings.rig.tick_rate_hz
            how = (
                f"a disturbance doubles every {1000.0 * math.log(2.0) / grows:.3g} ms"
                if grows > _STEADY
                else "a disturbance never dies out"
            )
            raise UserError(
                f"the loop is unstable with subject {name}: {how} at controller.inertia_kg_m2 = "
                f"{settings.controller.inertia_kg_m2:.4g} kg·m² against the arm's "
                f"{margins.joint.inertia_kg_m2:.4g} kg·m²; raise the controller's inertia or "
                "damping, or shorten the delays of filter, sensor and drive"
            )
        for sentence in near_instability(f"the loop with subject {name}", margins, settings):
            raise UserError(
                f"{sentence}; raise the controller's inertia or damping, shorten the delays, or "
                "lower the threshold if you know why"
            )


def _around(settings: Settings, joint: JointDynamics) -> list[JointDynamics]:
    """Return the joint with each of J, B and K at the lower, its own and the upper value."""
    factors = (settings.margins.joint_factor_low, 1.0, settings.margins.joint_factor_high)
    return [
        JointDynamics(
            joint.inertia_kg_m2 * a, joint.damping_nm_s_rad * b, joint.stiffness_nm_rad * c
        )
        for a, b, c in itertools.product(factors, repeat=3)
    ]


def _crossings(
    measure: Callable[[Complex], Array],
    curve_at: Callable[[Array], Complex],
    frequency_hz: Array,
    curve: Complex,
) -> Iterator[tuple[float, complex]]:
    """Yield frequency and value of the curve wherever a measure of it changes sign."""
    signs = np.signbit(measure(curve))
    for k in np.flatnonzero(signs[1:] != signs[:-1]):
        low, high = frequency_hz[k], frequency_hz[k + 1]
        for _ in range(_REFINEMENTS):
            fine = np.linspace(low, high, 65)
            inside = np.signbit(measure(curve_at(fine)))
            place = int(np.argmax(inside != inside[0]))
            low, high = fine[place - 1], fine[place]
        middle = float((low + high) / 2.0)
        yield middle, complex(curve_at(np.array([middle]))[0])
