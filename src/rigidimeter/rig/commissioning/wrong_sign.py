r"""Up to how much torque of the subject's own the guard finds a torque sensor of the wrong sign.

With Z = J s² + B s + K of the joint, and of the controller its admittance A from torque to velocity
behind its low-pass F, the open loop is L = F A Z/s (drive and delays included). With the wrong sign
perturbation and noise are both answered through 1/(1 − L), which is left out. In the rows of the
guard's test, one every T, the torque's answer S to the perturbation and all other torque N (subject
and sensor) then have the densities, in N²m²/Hz,

    S = |W|² |A Z/s|² a² T_c sinc²(f T_c)       W = H L_5³ (1 − z⁻¹)³       z = e^(2πi f T)
    N = |W|² (σ² Φ_sub + Φ_sensor)

with a and T_c amplitude and chip of the PRBS, σ the SD of the subject's own torque, Φ_sub its shape
in 1/Hz, H and L_5 the guard's filters of 5 Hz. An autoregression Φ(z) of order p makes N nearly
white. A window of n rows finds the sign where (`rig.guard.torque_sign`, f = n − 4 − 2p)

    R(σ) = ∫ |Φ|² S df / ∫ |Φ|² N df > m (f/n) (1/x_n − 1)        12 m in 24 rows, 2.2 m in 48

m = 16 is a margin. Half of the windows need 1.4 times what the equation says, a tenth have half as
much, and the own torque moves the arm as well. Where Φ_sub is most of N, R falls as (a/σ)², so that
m takes a quarter of the σ: with that, all epochs that were simulated found the sign.

Only windows count that are full, and looked at twice, before the arm is at its position limit, to
which it goes as

    (J_c − J) θ'' + (B_c − B) θ' − K θ = M_p
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import scipy

from rigidimeter.core.settings import Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.model import (
    JointDynamics,
    Loop,
    arm_response,
    median_joint,
    sensor_density,
    subject_density,
)
from rigidimeter.planning import prbs_nm
from rigidimeter.rig.commissioning.checks import RigCheck
from rigidimeter.rig.commissioning.static_tests import measured_noise_nm
from rigidimeter.rig.guard import DIFFERENCES, INSTRUMENTS, torque_answer

MARGIN = 16.0
MIN_NM = 1e-4
_LINES = 512


def hiding_torque_nm(settings: Settings, condition: str) -> float:
    """Return the SD of the subject's own torque above which the sign may stay hidden, in N·m.

    0 if it may even without any. Tremor counts as it is in the settings.
    """
    rig, prbs, limits = settings.rig, settings.prbs, torque_answer.answer_limits(settings)
    row_s = limits.steps_a_row * limits.step_s
    f = np.arange(1, _LINES + 1) / (2.0 * row_s * _LINES)
    once = np.exp(-2j * np.pi * f * row_s)
    relaxed = settings.subject[condition].model_copy(update={"voluntary_sd_nm": 0.0})
    pushing = relaxed.model_copy(update={"voluntary_sd_nm": 1.0, "tremor_amplitude_nm": 0.0})
    J, B, K = median_joint(relaxed).parameters
    loop = Loop(settings.controller, rig).at_frequency(f)
    low = 1.0 / (1.0 + 2j * np.pi * f / torque_answer.FILTER_RAD_S)
    rows = (1.0 - low) * low**3 * (1.0 - once) ** DIFFERENCES
    shown = loop.gain((J, B, K) if limits.shows_inertia else (0.0, B, 0.0)) / loop.forward
    answer = np.abs(rows * shown * loop.admittance) ** 2
    answer *= prbs.amplitude_nm**2 / prbs.clock_hz * np.sinc(f / prbs.clock_hz) ** 2
    still, own = (
        np.abs(rows) ** 2 * density
        for density in (
            subject_density(relaxed, f, rig.tick_rate_hz) + sensor_density(rig.torque),
            subject_density(pushing, f, rig.tick_rate_hz),
        )
    )

    def spare(log_nm: float, order: int, needed: float) -> float:
        noise = still + math.exp(2.0 * log_nm) * own
        lags = np.fft.irfft(np.append(0.0, noise))
        phi = scipy.linalg.solve_toeplitz(lags[:order], lags[1 : order + 1])
        white = np.abs(1.0 - once[:, None] ** np.arange(1, order + 1) @ phi) ** 2
        return math.log(float(white @ answer) / float(white @ noise) / needed)

    log_min, log_max, hiding_nm = math.log(MIN_NM), math.log(settings.guard.torque_limit_nm), 0.0
    free_s = _at_limit_s(settings, (J, B, K))
    for n, left in zip(torque_answer.ROWS, limits.left, strict=True):
        free = n - INSTRUMENTS - 2 * left.order
        of = left.order, MARGIN * free / n * (1.0 / left.at_once - 1.0)
        if (n + torque_answer.ROWS_A_TEST) * row_s < free_s and spare(log_min, *of) > 0.0:
            hides = spare(log_max, *of) < 0.0
            log_nm = scipy.optimize.brentq(spare, log_min, log_max, of) if hides else log_max
            hiding_nm = max(hiding_nm, math.exp(log_nm))
    return hiding_nm


def _at_limit_s(settings: Settings, joint: tuple[float, float, float]) -> float:
    """Return when an epoch from rest with the wrong sign brings the arm to its position limit."""
    controller, rate_hz = settings.controller, settings.rig.tick_rate_hz
    inertia = controller.inertia_kg_m2 - joint[0]
    if inertia <= 0.0:  # it goes at once
        return 0.0
    gone = JointDynamics(inertia, controller.damping_nm_s_rad - joint[1], -joint[2])
    angle_rad, _ = arm_response(gone, prbs_nm(settings.prbs, rate_hz), 1.0 / rate_hz)
    beyond = np.abs(angle_rad) > rad_from_deg(settings.guard.position_limit_deg)
    return float(np.argmax(beyond)) / rate_hz if beyond.any() else math.inf


def sign_words(settings: Settings, checks: Sequence[RigCheck]) -> str:
    """Return what protects from a wrong sign in sessions with these settings.

    Parameters
    ----------
    settings : Settings
        Of the protocol.
    checks : sequence of RigCheck
        Of the rig; the noise of the torque is taken from them.
    """
    daily = "repeat `rigidimeter check`, with nobody in the rig, before every session."
    blocks = settings.protocol.blocks
    perturbed = dict.fromkeys(block.condition for block in blocks if block.task == "prbs")
    if not perturbed:
        return (
            "This protocol has no torque perturbation: the guard cannot find a wrong sign of the "
            f"torque. So {daily}"
        )
    noise_nm = measured_noise_nm(checks)
    if noise_nm is not None:
        torque = settings.rig.torque.model_copy(update={"noise_sd_nm": noise_nm})
        rig = settings.rig.model_copy(update={"torque": torque})
        settings = settings.model_copy(update={"rig": rig})
    hiding_nm = {name: hiding_torque_nm(settings, name) for name in perturbed}
    found = ", ".join(
        f"{name} {nm:.2g} N·m" if nm else f"{name} perhaps none at all"
        for name, nm in hiding_nm.items()
    )
    imposed = any(block.task == "sinusoid" for block in blocks)
    return (
        "During a PRBS epoch a wrong torque sign is detected only while the subject's own torque "
        f"stays below (SD): {found}. Above that"
        f"{', and in an imposed sinusoid,' if imposed else ''} the daily check alone protects: "
        f"{daily}"
    )
