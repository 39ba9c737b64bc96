"""The controller that a recording shows, and how far it is from another.

Perturbation and measured torque make the velocity command, c = A (p − F M'), with the admittance A
and the low-pass F of the settings (`rigidimeter.model.linear_loop`). From one tick to the next

    p − F M' = B_c c(k) + β (c(k) − c(k − 1)),    β = B_c d / (1 − d),    d = e^(−B_c T/J_c)

so inertia and damping follow from a recorded command by least squares.

A movement that is imposed beside the perturbation adds a line to the command that no torque asked
for. The line at which the two differ most is therefore left out: a wrong controller is as wrong at
all the others.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.analysis.estimation.prepared import PreparedEpoch
from rigidimeter.analysis.estimation.signals import Array, sampled
from rigidimeter.analysis.estimation.window import Window, with_hole
from rigidimeter.core.records import Epoch
from rigidimeter.core.settings import ControllerSettings, Settings
from rigidimeter.model import DriveModel, Loop, admittance, butterworth_lowpass

COMPARED_HZ = (0.5, 10.0)
"""Below, the start of the epoch still counts; above, how the torque is held between its samples."""

LINE_BINS = 2
"""Half the width of a line in the window."""

LEAST_LEFT = 0.01
"""Of the command's power: with less beside that line, the line is compared too."""

FORGOTTEN_S = 1.0
"""So long after a stretch that is left out the comparison counts in full again."""


@dataclass(frozen=True, eq=False)
class CommandMade:
    """A recorded command, and what was asked of the admittance that made it.

    Attributes
    ----------
    command_rad_s, asked_nm : array, shape (n,)
        Velocity command, and perturbation less the torque as the loop read and filtered it.
    window : array, shape (n,)
    rate_hz : float
    """

    command_rad_s: Array
    asked_nm: Array
    window: Array
    rate_hz: float

    def misfit(self, controller: ControllerSettings) -> tuple[float, float]:
        """Return the difference of what a controller makes from the command, and its size.

        In % of the command, and as a factor of it; NaN where nothing was commanded.
        """
        both = self._both(controller)
        sent, made = both[:, self._kept(*both)]
        power = float(np.sum(np.abs(sent) ** 2))
        if power == 0.0:
            return np.nan, np.nan
        off = float(np.sqrt(np.sum(np.abs(sent - made) ** 2) / power))
        return 100.0 * off, float(np.sum((sent.conj() * made).real) / power)

    def shown(self, controller: ControllerSettings) -> ControllerSettings | None:
        """Return the controller with the inertia and damping that fit best, if there are such."""
        command = self.command_rad_s
        step_rad_s = np.diff(command, prepend=command[0])
        kept = self._kept(*self._both(controller))
        sent, step, asked = self._lines(command, step_rad_s, self.asked_nm)[:, kept]
        columns = np.stack([sent, step], axis=1)
        stacked = np.concatenate([columns.real, columns.imag])
        wanted = np.concatenate([asked.real, asked.imag])
        damping, beta = np.linalg.lstsq(stacked, wanted)[0].tolist()
        if not beta > 0:
            return None
        inertia = beta / self.rate_hz
        if damping > 0:
            inertia *= damping / beta / np.log1p(damping / beta)
        values = {"inertia_kg_m2": float(inertia), "damping_nm_s_rad": max(damping, 0.0)}
        return controller.model_copy(update=values)

    def _both(self, controller: ControllerSettings) -> NDArray[np.complex128]:
        """Return the lines of the command and of what a controller makes."""
        decay, gain = admittance(
            controller.inertia_kg_m2, controller.damping_nm_s_rad, 1.0 / self.rate_hz
        )
        made_rad_s = scipy.signal.lfilter([gain], [1.0, -decay], self.asked_nm)
        return self._lines(self.command_rad_s, made_rad_s)

    @staticmethod
    def _kept(sent: NDArray[np.complex128], made: NDArray[np.complex128]) -> NDArray[np.bool_]:
        """Return which lines are compared: all but the one at which the two differ most."""
        kept = np.abs(np.arange(sent.size) - np.argmax(np.abs(sent - made))) > LINE_BINS
        power = np.abs(sent) ** 2
        enough = np.sum(power[kept]) > LEAST_LEFT * np.sum(power)
        return kept if enough else np.ones(sent.size, dtype=np.bool_)

    def _lines(self, *signals: Array) -> NDArray[np.complex128]:
        first, last = (int(edge * self.window.size / self.rate_hz) for edge in COMPARED_HZ)
        spectra = scipy.fft.rfft(np.stack([one * self.window for one in signals]), axis=1)
        return np.asarray(spectra[:, first : last + 1])


def command_made(epoch: Epoch, loop: Loop) -> CommandMade | None:
    """Return the command of an epoch and what made it; None where ticks are missing.

    Parameters
    ----------
    epoch : Epoch
        With perturbation and velocity command.
    loop : Loop
        Of the settings.
    """
    command = epoch.channels["velocity_command_rad_s"]
    rate_hz, n = command.mean_rate_hz, command.time_s.size
    steps_s = np.diff(command.time_s)
    if np.max(steps_s) - np.min(steps_s) > 0.5 / rate_hz:
        return None
    window = _hann(n)
    for stretch in epoch.left_out:  # there neither torque nor, where samples are lost, command is
        hole_s = (stretch.start_s - command.time_s[0], stretch.stop_s - command.time_s[0])
        window = with_hole(window, rate_hz, FORGOTTEN_S, hole_s)
    asked = _asked_nm(epoch, loop, command.time_s, rate_hz)
    return CommandMade(command.values, asked, window.value, rate_hz)


@lru_cache(maxsize=4)
def _hann(n: int) -> Window:
    """Return a window of Hann, whose derivatives are not needed."""
    window = Window(np.hanning(n), np.zeros(n), np.zeros(n))
    for part in window:
        part.setflags(write=False)
    return window


def loop_shown(prepared: PreparedEpoch) -> Loop:
    """Return the loop that the settings describe, with the drive that the recording shows."""
    found = prepared.source.drive
    drive = found.model if found is not None else None
    return loop_of(prepared.settings, prepared.epoch.channels["torque_nm"].rate_hz, drive)


def misfit_of_settings(prepared: PreparedEpoch) -> tuple[float, float] | None:
    """Return `CommandMade.misfit` of the settings' controller; None where nothing can be said."""
    loop = loop_shown(prepared)
    made = command_made(prepared.epoch, loop)
    return None if made is None else made.misfit(loop.controller)


def controller_used(prepared: PreparedEpoch) -> Loop:
    """Return the loop with the controller that the recording shows.

    That is the one of the settings unless another makes the recorded command and it does not.
    """
    loop, channels = loop_shown(prepared), prepared.epoch.channels
    if not all(name in channels for name in ("velocity_command_rad_s", "perturbation_nm")):
        return loop
    misfit = prepared.once(misfit_of_settings)
    most = prepared.settings.diagnostics.max_controller_misfit_percent
    shown = controller_shown(prepared, loop) if misfit and misfit[0] > most else None
    return loop if shown is None else replace(loop, controller=shown)


def loop_known(prepared: PreparedEpoch) -> bool:
    """Whether the loop that the epoch ran in is known: recorded, or stated in the settings.

    The controller's defaults are the paper's, which are no reason to think that a robot gave way.
    """
    recorded = ("perturbation_nm", "velocity_command_rad_s")
    stated = "controller" in prepared.settings.model_fields_set
    return stated or any(name in prepared.epoch.channels for name in recorded)


def controller_shown(prepared: PreparedEpoch, loop: Loop) -> ControllerSettings | None:
    """Return the controller that makes the recorded command, if there is one."""
    made = command_made(prepared.epoch, loop)
    shown = made.shown(loop.controller) if made is not None else None
    most = prepared.settings.diagnostics.max_controller_misfit_percent
    return None if made is None or shown is None or made.misfit(shown)[0] > most else shown


def _asked_nm(epoch: Epoch, loop: Loop, ticks_s: Array, rate_hz: float) -> Array:
    perturbation, torque = epoch.channels["perturbation_nm"], epoch.channels["torque_nm"]
    at_ticks: slice | NDArray[np.intp] | None = sampled(perturbation, ticks_s)
    if at_ticks is None:
        held = np.searchsorted(perturbation.time_s, ticks_s + 0.01 / rate_hz, side="right") - 1
        at_ticks = np.maximum(held, 0)
    # The newest sample at a tick is half an interval old on average, beside the latency.
    late_s = loop.rig.torque.latency_s + max(0.5 / torque.rate_hz - 0.5 / rate_hz, 0.0)
    read = np.interp(ticks_s - late_s, torque.time_s, torque.values)
    cutoff_hz = loop.controller.torque_cutoff_hz
    if cutoff_hz < rate_hz / 2:
        b0, b1, b2, a1, a2 = butterworth_lowpass(cutoff_hz, rate_hz)
        read = scipy.signal.lfilter([b0, b1, b2], [1.0, a1, a2], read)
    return np.asarray(perturbation.values[at_ticks] - read, dtype=np.float64)


def loop_of(settings: Settings, torque_rate_hz: float, drive: DriveModel | None) -> Loop:
    """Return the loop that settings describe, with the drive that a recording shows.

    Instruments made from a wrong loop are weaker, not wrong: whatever they are, they follow from
    the perturbation alone.
    """
    rig, estimation = settings.rig, settings.estimation
    # To the digits that stamps are good for, so that epochs of one rig have equal loops.
    torque = rig.torque.model_copy(update={"rate_hz": float(f"{torque_rate_hz:.4g}")})
    return Loop(
        settings.controller,
        rig.model_copy(update={"torque": torque}),
        drive,
        estimation.torque_lowpass_hz,
        estimation.torque_lowpass_order,
    )
