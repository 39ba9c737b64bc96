"""Eq. 6 and 7, and what a high-pass on the position alone does to Eq. 6.

A filter commutes with Eq. 3 only if every term goes through it. The paper high-passes the position
at 0.20 Hz and nothing else. In the ideal closed loop, without noise, what that does is exact:
`highpass_errors_percent`. The ends, where a filter has no neighbours, are dropped.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from rigidimeter.analysis.estimation import Signals, fit_inertia_damping_stiffness
from rigidimeter.core.settings import Settings
from rigidimeter.paper import printed
from rigidimeter.paper.comparison_table import Bound, Claim, bounded
from rigidimeter.paper.context import Context
from rigidimeter.paper.controller import READINGS
from rigidimeter.paper.simulated_epochs import Triple, errors_percent, signed
from rigidimeter.planning import ideal_response, prbs_nm

FILTERS = ("causal", "zero phase")
"""The paper does not say which way its filter runs, nor its order; second order here."""

UNBIASED_PERCENT = 1.0
"""What counts as no bias in a loop without noise."""


def highpass_errors_percent(reading: str, way: str, *, alike: bool) -> Triple:
    """Return the errors of J, B and K in the noise-free loop, in percent.

    Parameters
    ----------
    reading : str
        A key of `controller.READINGS`.
    way : str
        One of `FILTERS`.
    alike : bool
        Whether all four signals go through the filter, or the position alone.
    """
    settings = Settings()
    estimation, rate_hz = settings.estimation, settings.rig.tick_rate_hz
    sections = signal.butter(
        estimation.published_highpass_order,
        estimation.published_highpass_hz,
        "highpass",
        fs=rate_hz,
        output="sos",
    )
    high_pass = signal.sosfilt if way == "causal" else signal.sosfiltfilt
    raw = _ideal_signals(reading, settings)
    trim = round(estimation.trim_s * rate_hz)
    kept = slice(trim, raw.time_s.size - trim)

    def treated(values: NDArray[np.float64], *, filtered: bool) -> NDArray[np.float64]:
        passed = high_pass(sections, values) if filtered else values
        return np.asarray(passed[kept], dtype=np.float64)

    cut = replace(
        raw,
        time_s=raw.time_s[kept],
        torque_nm=treated(raw.torque_nm, filtered=alike),
        acceleration_rad_s2=treated(raw.acceleration_rad_s2, filtered=alike),
        velocity_rad_s=treated(raw.velocity_rad_s, filtered=alike),
        angle_rad=treated(raw.angle_rad, filtered=True),
    )
    return errors_percent(fit_inertia_damping_stiffness(cut).value)


def _ideal_signals(reading: str, settings: Settings) -> Signals:
    """Return the arm of Sec. 3.4 in the ideal loop: no noise, no filter, no lag."""
    rate_hz, joint, controller = settings.rig.tick_rate_hz, printed.SEC_34, READINGS[reading]
    perturbation = prbs_nm(settings.prbs, rate_hz)
    angle, velocity = ideal_response(perturbation, controller, joint, rate_hz)
    total = joint.inertia_kg_m2 + controller.inertia_kg_m2
    damping = joint.damping_nm_s_rad + controller.damping_nm_s_rad
    acceleration = (perturbation - damping * velocity - joint.stiffness_nm_rad * angle) / total
    return Signals(
        time_s=np.arange(angle.size) / rate_hz,
        torque_nm=joint.torque_nm(angle, velocity, acceleration),
        acceleration_rad_s2=acceleration,
        velocity_rad_s=velocity,
        angle_rad=angle,
        rate_hz=rate_hz,
        band_hz=(0.0, rate_hz / 2.0),
    )


def equation_6(context: Context) -> Claim:
    """Compare least squares on signals that were all treated alike with the joint."""
    worst = max(
        abs(error)
        for way in FILTERS
        for error in highpass_errors_percent("per degree", way, alike=True)
    )
    return Claim(
        ours="noise-free loop, all four signals high-passed alike: J, B and K within "
        f"{worst:.2f} %",
        checks=(bounded("Largest error of J, B, K", "%", worst, high=UNBIASED_PERCENT),),
    )


def equation_7(context: Context) -> Claim:
    """Compare B and K with the joint when J is held: at the truth, and at another printed median.

    In the noise-free loop nothing but Eq. 7 itself can put B and K off.
    """
    signals = _ideal_signals("per degree", context.settings)

    def held(inertia_kg_m2: float) -> Triple:
        fit = fit_inertia_damping_stiffness(signals, inertia_kg_m2)
        return errors_percent(fit.value)

    true, other = held(printed.SEC_34.inertia_kg_m2), held(printed.FIG_4.inertia_kg_m2)
    worst = max(abs(error) for error in true[1:])
    return Claim(
        ours=f"noise-free loop, J held at its true {printed.SEC_34.inertia_kg_m2:g} kg·m²: B and K "
        f"within {worst:.2f} %; held at {printed.FIG_4.inertia_kg_m2:g}, the median that Sec. 3.5 "
        f"prints: B {signed(other[1], 2)} %, K {signed(other[2], 2)} %",
        checks=(bounded("Largest error of B, K", "%", worst, high=UNBIASED_PERCENT),),
    )


def highpass(reading: str, context: Context) -> Claim:
    """Compare the high-pass on the position alone, with the controller read either way."""
    errors = {way: highpass_errors_percent(reading, way, alike=False)[2] for way in FILTERS}
    text = ", ".join(f"{signed(error, 0)} % {way}" for way, error in errors.items())
    alike = max(abs(highpass_errors_percent(reading, way, alike=True)[2]) for way in FILTERS)
    return Claim(
        ours=f"error of K without any noise, controller read {reading}: {text}; all four signals "
        f"alike {alike:.2f} %",
        reading="Second-order Butterworth; order and direction are not printed. We filter all "
        "signals alike and keep the printed way as the method published.",
        checks=tuple(
            Bound(f"Error of K, {way}", "%", 0.0, error, -UNBIASED_PERCENT, UNBIASED_PERCENT)
            for way, error in errors.items()
        ),
    )
