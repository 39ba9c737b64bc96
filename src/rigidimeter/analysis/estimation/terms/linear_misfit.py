"""What is linear in the motion and is not J, B and K: a soft coupling, a reflex of both directions.

The torque at the lines of `beyond_linear` is held against the angle x in three ways, each line
divided by the size of what no linear filter explains: by J, B and K, with the sum of squares R₀; by
the free filter, R; and by J, B and K with one linear term,

    soft coupling of stiffness k     M = P x / (1 + P/k),    P = J s² + B s + K,    s = jω
    reflex of both directions        M = P x + g e^(−sτ) s x

Where the free filter explains more than J, B and K by more than chance (Fisher's distribution), and
one of the terms explains nearly all of that, it is named. Torque of the subject's own comes back as
motion too, but at its own frequencies, which weigh little; a delay or a filter of the torque, or
both terms at once, look like neither.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import scipy

from rigidimeter.analysis.estimation.signals import Array
from rigidimeter.analysis.estimation.terms.beyond_linear import BeyondLinear
from rigidimeter.analysis.estimation.terms.explained import (
    Complex,
    Filtered,
    Gains,
    explained,
    stacked,
    strongest,
)
from rigidimeter.analysis.estimation.terms.omitted_terms import CHANCE

NEARLY_ALL = 0.9
"""Of what J, B and K leave to a free filter, that a term must explain."""

DELAYS_S = np.arange(0.025, 0.151, 0.005)
SOFTEST = 0.05, 0.2
"""Compliances of the coupling with which the search begins, times that of the joint."""


class LinearTerm(NamedTuple):
    """A linear term.

    Attributes
    ----------
    name : {"coupling", "reflex"}
    value : float
        k in N·m/rad, or g in N·m·s/rad.
    delay_s : float
        τ; 0 for a coupling.
    joint : array, shape (3,)
        J, B and K beside it.
    share : float
        How much it explains of what J, B and K leave to a free filter.
    p : float
        Probability that chance leaves as much to the free filter.
    """

    name: str
    value: float
    delay_s: float
    joint: Array
    share: float
    p: float

    def torque(self, motion: Complex, omega_rad_s: Array) -> Complex:
        """Return the lines of its torque, for acceleration, velocity and angle, shape (m, 3)."""
        if self.name == "reflex":
            delayed = np.exp(-1j * omega_rad_s * self.delay_s) * motion[:, 1]
            return np.asarray(self.value * delayed)
        J, B, K = self.joint
        path = K - J * omega_rad_s**2 + 1j * omega_rad_s * B
        return np.asarray((path / (1 + path / self.value) - path) * motion[:, 2])


def linear_term(beyond: BeyondLinear) -> LinearTerm | None:
    """Return the linear term that is there; None where there is none, or none that is known."""
    size = beyond.line_size_nm
    omega = 2 * np.pi * beyond.frequency_hz
    lines = beyond.torque_lines / size
    target = stacked(lines)
    motion = beyond.linear / size[:, None]
    rest, joint = explained(stacked(motion), target)
    free = float(np.sum(np.abs(beyond.torque) ** 2))
    taken = beyond.free_gains - 3
    left = target.size - beyond.free_gains
    ratio = (rest - free) / taken / beyond.taper_loss / (free / left)
    p = float(scipy.special.fdtrc(taken, left, ratio))
    if not p < CHANCE:
        return None
    found = [_coupling(joint, omega, motion[:, 2], target), _both_directions(motion, omega, lines)]
    (name, value, delay_s, values), remains = min(found, key=lambda one: one[1])
    share = (rest - remains) / (rest - free)
    if share < NEARLY_ALL or not value > 0:
        return None
    return LinearTerm(name, value, delay_s, values, share, p)


Found = tuple[tuple[str, float, float, Array], float]
"""Name, value, delay and J, B, K; and what is left."""


def _coupling(joint: Array, omega: Array, angle: Complex, target: Array) -> Found:
    start = np.maximum(np.abs(joint), 1e-12)
    s = 1j * omega
    # Of the impedance, by J, B and K as shares of their start.
    slopes: Complex = np.stack([s**2, s, np.ones_like(s)], axis=1) * start

    def through(values: Array) -> tuple[Complex, Complex]:
        path = slopes @ values[:3]
        soft = 1 / (1 + values[3] / start[2] * path)
        return path, soft

    def residual(values: Array) -> Array:
        path, soft = through(values)
        return target - stacked(path * soft * angle)

    def jacobian(values: Array) -> Array:
        path, soft = through(values)
        passed = soft**2 * angle
        by_softness = -(path**2) * passed / start[2]
        return -stacked(np.column_stack([slopes * passed[:, None], by_softness]))

    tried = []
    for softness in SOFTEST:
        values, *_ = scipy.optimize.leastsq(
            residual,
            [1.0, 1.0, 1.0, softness],
            Dfun=jacobian,
            full_output=True,
            ftol=1e-8,
            xtol=1e-8,
            gtol=1e-8,
            maxfev=30,
        )
        tried.append((float(np.sum(residual(values) ** 2)), values))
    remains, values = min(tried, key=lambda one: one[0])
    softness = float(values[3]) / float(start[2])
    value = 1.0 / softness if softness != 0 else np.inf
    return ("coupling", value, 0.0, np.asarray(values[:3] * start)), remains


def _both_directions(motion: Complex, omega: Array, target: Complex) -> Found:
    turns = Gains.of(np.exp(-1j * omega[:, None] * DELAYS_S))
    late = Filtered(motion[:, 1], turns)
    best = strongest(motion, late, target)
    columns = np.column_stack([motion, late.column(best)])
    rest, values = explained(stacked(columns), stacked(target))
    return ("reflex", float(values[3]), float(DELAYS_S[best]), values[:3]), rest
