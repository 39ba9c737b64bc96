"""Whether the controller of the settings can be the one that moved the joint.

Perturbation and measured torque make the velocity command, c = A (p − F M'), with the admittance A
and the low-pass F of the settings (`rigidimeter.dynamics.linear_loop`). Where the command was
recorded it is held against that; and a loop that would be unstable with the joint that was
estimated cannot have moved it.
"""

from __future__ import annotations

import numpy as np
from scipy import signal

from rigidimeter.control import admittance, butterworth_lowpass
from rigidimeter.dynamics import JointDynamics, Loop, spectral_radius
from rigidimeter.estimation.diagnostics.check_record import (
    Case,
    Check,
    Look,
    at_most,
    in_full,
    push_harmless,
)
from rigidimeter.estimation.signals import Array
from rigidimeter.estimation.window import with_hole
from rigidimeter.records import Epoch
from rigidimeter.settings import DiagnosticsSettings, Settings

COMPARED_HZ = (0.5, 10.0)
"""Below, the start of the epoch still counts; above, how the torque is held between its samples."""

FORGOTTEN_S = 1.0
"""So long after a stretch that is left out the comparison counts in full again."""

REMEDY = "give the values that were used, per radian: --controller, or [controller] in the settings"


def controller_misfit(epoch: Epoch, loop: Loop, settings: DiagnosticsSettings) -> Look | None:
    """Return how far the command is from what the controller makes of perturbation and torque."""
    command = epoch.channels["velocity_command_rad_s"]
    rate_hz = command.mean_rate_hz
    if float(np.ptp(np.diff(command.time_s))) > 0.5 / rate_hz:
        return None  # ticks are missing
    expected = _command_rad_s(epoch, loop, command.time_s, rate_hz)
    n = command.time_s.size
    window, steep = np.hanning(n), np.zeros(n)
    for stretch in epoch.left_out:  # there neither torque nor, where samples are lost, command is
        hole_s = (stretch.start_s - command.time_s[0], stretch.stop_s - command.time_s[0])
        window, steep = with_hole(window, steep, rate_hz, FORGOTTEN_S, hole_s)
    both = np.fft.rfft(np.stack([command.values, expected]) * window, axis=1)
    first, last = (int(frequency * n / rate_hz) for frequency in COMPARED_HZ)
    sent, made = both[:, first : last + 1]
    power = float(np.sum(np.abs(sent) ** 2))
    if power == 0.0:
        return None
    value = 100.0 * float(np.sqrt(np.sum(np.abs(sent - made) ** 2) / power))
    # What would have been sent, per what was.
    factor = float(np.sum((sent.conj() * made).real) / power)
    most = settings.controller_misfit_most_percent
    return at_most(
        value,
        most,
        (
            f"from perturbation and torque the controller of the settings makes a velocity command "
            f"that differs from the recorded one by {in_full(value)} % (at most {most:g} %) and is "
            f"{factor:.2g} times as large"
        ),
    )


def unstable_loop(parameters: Array, loop: Loop) -> Look | None:
    """Return the growth per second of the loop of the settings with the joint that was found."""
    if not np.all(parameters >= 0):
        return None  # no such joint
    settings = Settings().model_copy(update={"controller": loop.controller, "rig": loop.rig})
    radius = spectral_radius(settings, JointDynamics(*parameters.tolist()))
    value = float(np.log(max(radius, 1e-12))) * loop.rig.tick_rate_hz
    return at_most(
        value,
        0.0,
        f"with the controller of the settings and this joint the loop's slowest motion changes by "
        f"a factor of e^({value:.2g}) a second (at most 1)",
    )


def _command_rad_s(epoch: Epoch, loop: Loop, ticks_s: Array, rate_hz: float) -> Array:
    perturbation, torque = epoch.channels["perturbation_nm"], epoch.channels["torque_nm"]
    held = np.searchsorted(perturbation.time_s, ticks_s + 0.01 / rate_hz, side="right") - 1
    # The newest sample at a tick is half an interval old on average, beside the latency.
    late_s = loop.rig.torque.latency_s + max(0.5 / torque.rate_hz - 0.5 / rate_hz, 0.0)
    read = np.interp(ticks_s - late_s, torque.time_s, torque.values)
    cutoff_hz = loop.controller.torque_cutoff_hz
    if cutoff_hz < rate_hz / 2:
        b0, b1, b2, a1, a2 = butterworth_lowpass(cutoff_hz, rate_hz)
        read = signal.lfilter([b0, b1, b2], [1.0, a1, a2], read)
    decay, gain = admittance(
        loop.controller.inertia_kg_m2, loop.controller.damping_nm_s_rad, 1.0 / rate_hz
    )
    asked = perturbation.values[np.maximum(held, 0)] - read
    return np.asarray(signal.lfilter([gain], [1.0, -decay], asked), dtype=np.float64)


def _harmless(case: Case, look: Look) -> str:
    """Return why a wrong controller does not bias the estimate; empty where it does."""
    if case.uses_perturbation and case.method is not None:
        return f"{case.method.name} is less precise with it, not biased"
    return push_harmless(case, look)


CONTROLLER_CHECKS = (
    Check(
        "controller_misfit",
        ("velocity_command_rad_s", "perturbation_nm"),
        lambda c: controller_misfit(c.epoch, c.loop, c.settings) if c.loop is not None else None,
        "what is computed of the loop is that of another one",
        REMEDY,
        of_fit=False,
        harmless=_harmless,
    ),
    Check(
        "unstable_loop",
        ("perturbation_nm",),
        lambda c: unstable_loop(c.parameters, c.loop) if c.loop is not None else None,
        "the joint or the controller was another one",
        REMEDY,
        harmless=_harmless,
    ),
)
