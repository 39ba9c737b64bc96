"""Standard errors of J, B and K before anyone is perturbed.

Every estimator of Eq. 3 from one epoch solves, with z = (θ'', v, θ) and the torque noise
ν = sensor noise − M_sub,

    M = z·(J, B, K) + ν

Z is the Fourier transform over the epoch of the motion that the perturbation alone causes in the
closed loop, S the density of ν, and T the length of the epoch.

- bound: (∫ ZZᴴ / S df)⁻¹ over all frequencies that the torque's samples hold. No estimator that
  leans on the perturbation alone can do better. (One that knew S could also use the motion that the
  subject's own torque causes. `bound` leaves that out.)
- `iv`: that motion as the instrument, the lines of a window weighed by their noise; see
  `predicted_record`.
- least squares without weights, of signals that all went through a band of gain g: A⁻¹ Q A⁻¹ with
  A = ∫ g² ZZᴴ df and Q = ∫ g⁴ ZZᴴ S df, S that of the sensor: the standard error of a passive arm.

The motion in answer to M_sub does not enter the standard error of `iv` to first order, since M_sub
does not know the instrument. For least squares it does: M_sub moves the arm through the loop, and
the motion it causes is correlated with it, so that least squares is wrong on average, by

    (∫ g² (ZZᴴ + T S NNᴴ) df)⁻¹ T ∫ g² S Re(N) df

with S that of the subject and N the motion per N·m of voluntary torque: `least_squares_bias`.

References
----------
L. Ljung, "System Identification: Theory for the User", 2nd ed., 1999, ch. 7, 9 and 13.
T. Söderström and P. Stoica, "Instrumental Variable Methods for System Identification", 1983.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy

from rigidimeter.core.errors import UserError
from rigidimeter.core.records import readonly
from rigidimeter.core.settings import (
    USABLE_FRACTION_OF_RATE,
    RigSettings,
    Settings,
    SubjectSettings,
)
from rigidimeter.model import (
    Array,
    ClosedLoopMotion,
    Complex,
    JointDynamics,
    Loop,
    closed_loop_motion,
    median_joint,
    sensor_density,
    subject_density,
)
from rigidimeter.planning.predicted_record import (
    PredictedRecord,
    expected_record,
    layout,
    noise_spectrum,
    weighted_products,
)

_MAX_CONDITION = 1e12
"""Above this condition number of scaled regressors the errors are not worth printing."""

PARAMETER_NAMES = ("inertia_kg_m2", "damping_nm_s_rad", "stiffness_nm_rad")
"""In the order of every array here."""


@dataclass(frozen=True)
class Errors:
    """Standard errors of one epoch, in the units of `PARAMETER_NAMES`.

    Attributes
    ----------
    free : (float, float, float)
        J, B and K estimated together.
    fixed_inertia : (float, float)
        B and K with J held at its true value, as the second stage does (Eq. 7).
    """

    free: tuple[float, float, float]
    fixed_inertia: tuple[float, float]


@dataclass(frozen=True)
class PredictedPrecision:
    """What one epoch of a perturbation can tell about one joint.

    Attributes
    ----------
    joint : JointDynamics
    iv_band_hz, least_squares_band_hz : (float, float)
        The first and the last line of `iv`; the band of `least_squares`.
    bound, iv, least_squares : Errors
        `least_squares` is without voluntary torque and tremor.
    covariance : array, shape (3, 3)
        Of (J, B, K) by `iv`.
    least_squares_bias : (float, float, float)
        What voluntary torque and tremor add to J, B and K of least squares.
    angle_sd_rad, peak_angle_rad : float
        Of the motion that the perturbation causes.
    """

    joint: JointDynamics
    iv_band_hz: tuple[float, float]
    least_squares_band_hz: tuple[float, float]
    bound: Errors
    iv: Errors
    least_squares: Errors
    covariance: Array
    least_squares_bias: tuple[float, float, float]
    angle_sd_rad: float
    peak_angle_rad: float

    @property
    def values(self) -> tuple[float, float, float]:
        """J, B and K of the joint."""
        return self.joint.parameters

    def iv_pooled(self, epochs: int) -> tuple[float, float, float]:
        """Return the standard errors of J, B and K by `iv` over so many epochs."""
        J, B, K = (error / math.sqrt(epochs) for error in self.iv.free)
        return J, B, K


def predicted_precision(
    perturbation_nm: Array, settings: Settings, subject: SubjectSettings
) -> PredictedPrecision:
    """Return the standard errors of one epoch for the median joint of a subject.

    Parameters
    ----------
    perturbation_nm : array, shape (n,)
        One value a tick, from rest.
    settings : Settings
        For loop, sensors and estimation.
    subject : SubjectSettings
        Its median joint, voluntary torque and tremor.

    Raises
    ------
    UserError
        If trimming leaves nothing, or a band holds too few lines.
    """
    estimation, rig = settings.estimation, settings.rig
    joint = median_joint(subject)
    motion = closed_loop_motion(perturbation_nm, settings, joint)
    if motion.angle_rad.size <= 2.0 * estimation.trim_s * rig.tick_rate_hz + 1.0:
        raise UserError(
            f"estimation.trim_s = {estimation.trim_s:g} s at either end leaves nothing of an epoch "
            f"of {motion.angle_rad.size / rig.tick_rate_hz:g} s"
        )
    record = expected_record(motion, rig)
    lines = layout(record, estimation)
    band_hz, least_squares, bias = _least_squares(motion, settings, subject, joint)
    bound = iv = Errors((0.0, 0.0, 0.0), (0.0, 0.0))
    covariance = np.zeros((3, 3))
    own = subject.voluntary_sd_nm > 0.0 or subject.tremor_amplitude_nm > 0.0
    if own or sensor_density(rig.torque) > 0.0:  # otherwise nothing hides the joint
        A, Q = weighted_products(record, rig, subject, lines)
        bound, iv, covariance = _bound(record, rig, subject), _errors(A, Q), _sandwich(A, Q)
    return PredictedPrecision(
        joint=joint,
        iv_band_hz=lines.band_hz,
        least_squares_band_hz=band_hz,
        bound=bound,
        iv=iv,
        least_squares=least_squares,
        covariance=readonly(covariance),
        least_squares_bias=bias,
        angle_sd_rad=float(np.std(motion.angle_rad)),
        peak_angle_rad=float(np.max(np.abs(motion.angle_rad))),
    )


def _products(Z: Complex, weight: Array, n: int) -> Array:
    """Return Σ ZZᴴ w / n over both signs of frequency, shape (3, 3)."""
    sides = np.full(Z.shape[1], 2.0)
    sides[0] = 1.0
    if n % 2 == 0:
        sides[-1] = 1.0
    return np.asarray(np.real((Z * (weight * sides)) @ Z.conj().T)) / n


def _sandwich(A: Array, Q: Array) -> Array:
    """Return A⁻¹ Q A⁻ᵀ after scaling: the columns differ by powers of ten in their units."""
    scale = 1.0 / np.sqrt(np.diag(A))
    scaled = A * np.outer(scale, scale)
    if np.linalg.cond(scaled) > _MAX_CONDITION:
        raise UserError(
            "the predicted motion cannot distinguish J, B and K; the perturbation needs more lines "
            "in the band"
        )
    half = np.linalg.solve(scaled, Q * np.outer(scale, scale))
    return np.asarray(np.linalg.solve(scaled, half.T) * np.outer(scale, scale))


def _bound(record: PredictedRecord, rig: RigSettings, subject: SubjectSettings) -> Errors:
    # The noise does not end with the record: the lines are twice as fine as the record's own.
    padded = 2 * scipy.fft.next_fast_len(record.motion.shape[1], real=True)
    density = noise_spectrum(rig, subject, scipy.fft.rfftfreq(padded, 1.0 / record.rate_hz))
    if np.any(density == 0.0):  # at a frequency without noise nothing hides the joint
        return Errors((0.0, 0.0, 0.0), (0.0, 0.0))
    information = _products(scipy.fft.rfft(record.motion, padded), 1.0 / density, padded)
    return _errors(information, information)


def _errors(A: Array, Q: Array) -> Errors:
    J, B, K = np.sqrt(np.diag(_sandwich(A, Q)))
    fixed_B, fixed_K = np.sqrt(np.diag(_sandwich(A[1:, 1:], Q[1:, 1:])))
    return Errors((float(J), float(B), float(K)), (float(fixed_B), float(fixed_K)))


def _least_squares(
    motion: ClosedLoopMotion, settings: Settings, subject: SubjectSettings, joint: JointDynamics
) -> tuple[tuple[float, float], Errors, tuple[float, float, float]]:
    """Return band, errors of a passive arm, and bias of least squares without weights."""
    estimation, rig = settings.estimation, settings.rig
    slowest_hz = min(rig.torque.rate_hz, rig.motion.rate_hz)
    low_hz = estimation.band_low_hz
    high_hz = min(estimation.band_high_hz, USABLE_FRACTION_OF_RATE * slowest_hz)
    trim = round(estimation.trim_s * rig.tick_rate_hz)
    kept = motion.angle_rad.size - 2 * trim
    frequency = scipy.fft.rfftfreq(kept, 1.0 / rig.tick_rate_hz)
    inside = (frequency >= low_hz) & (frequency <= high_hz)
    if np.count_nonzero(inside) < len(PARAMETER_NAMES):
        raise UserError(
            f"the band {low_hz:g} to {high_hz:g} Hz holds {np.count_nonzero(inside)} lines of an "
            f"epoch of {kept / rig.tick_rate_hz:g} s; the fit needs at least {len(PARAMETER_NAMES)}"
        )
    # Butterworth filters, second order below and fourth above, used twice.
    with np.errstate(divide="ignore"):
        above = 1.0 / (1.0 + (low_hz / frequency) ** 4)
    gain = np.asarray(above / (1.0 + (frequency / high_hz) ** 8))
    Z = np.asarray(scipy.fft.rfft(np.stack(motion[1:])[:, trim : trim + kept]))
    A = _products(Z, gain**2, kept) / rig.tick_rate_hz
    Q = _products(Z, gain**4, kept) / rig.tick_rate_hz * sensor_density(rig.torque)
    voluntary = subject_density(subject, frequency, rig.tick_rate_hz) * gain**2
    bias = _bias(A, settings, joint, frequency, voluntary)
    return (low_hz, high_hz), _errors(A, Q), bias


def _bias(
    A: Array,
    settings: Settings,
    joint: JointDynamics,
    frequency_hz: Array,
    density: Array,
) -> tuple[float, float, float]:
    """Return how far voluntary torque of this density pulls least squares, on average."""
    if not np.any(density):
        return 0.0, 0.0, 0.0
    some = density > 0.0
    loop = Loop(settings.controller, settings.rig).at_frequency(frequency_hz[some])
    N = loop.motion_per_torque(joint.parameters)
    power = 2.0 * density[some]
    moved = np.real((N * power) @ N.conj().T)
    # The reading holds ν at its own time; N is the motion at the same time.
    pulled = np.real(N.conj() @ power)
    bias = np.linalg.solve(A + moved, pulled)
    return float(bias[0]), float(bias[1]), float(bias[2])
