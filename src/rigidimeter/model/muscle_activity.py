"""EMG of the virtual subject: noise in 20–450 Hz whose amplitude follows the torque it makes.

The EMG of a muscle is, with w and n white in their band and of unit variance,

    emg(t) = a · max(±M_sub(t), 0) · w(t) + b · n(t) + h · sin(2π · 50 Hz · t + φ)

with + for muscles that drive the joint toward positive angles. The torque comes before the joint,
so a muscle is active in proportion to what the subject does, not to how the joint answers.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import islice

import numpy as np
import scipy
from numpy.typing import NDArray

from rigidimeter.core.settings import EmgSettings, Settings, SubjectSettings
from rigidimeter.model.emg_envelope import EMG_BAND_HZ
from rigidimeter.model.subject_torque import (
    SubjectTorque,
    noise_band,
    one_by_one,
    rig_streams,
)

Array = NDArray[np.float64]

HUM_HZ = 50.0
_V_PER_UV = 1e-6


class VirtualEmg:
    """EMG in V of the muscles of a subject whose torque is known, block by block.

    Parameters
    ----------
    settings : EmgSettings
    rng : numpy.random.Generator
    """

    def __init__(self, settings: EmgSettings, rng: np.random.Generator) -> None:
        self._settings = settings
        # Two streams for each muscle: the numbers are the same however blocks are cut.
        self._rngs = [muscle.spawn(2) for muscle in rng.spawn(len(settings.muscles))]
        self._sos, energy = noise_band(*EMG_BAND_HZ, settings.rate_hz)
        self._gain = _V_PER_UV * settings.virtual_uv_per_nm / math.sqrt(energy)
        self._memories = [np.zeros((self._sos.shape[0], 2)) for _ in self._rngs]
        self._phases_rad = [float(still.uniform(0.0, 2.0 * math.pi)) for _, still in self._rngs]
        self._next = 0
        for muscle in range(len(self._rngs)):  # let the filter settle
            self._noise(muscle, round(0.2 * settings.rate_hz))

    def block(self, torque_nm: Array) -> Array:
        """Return the next samples, shape (n, muscles).

        Parameters
        ----------
        torque_nm : array, shape (n,)
            Of the subject itself, at the time of each sample.
        """
        s, n = self._settings, torque_nm.size
        if not n:
            return np.empty((0, len(self._rngs)))
        time_s = (self._next + np.arange(n)) / s.rate_hz
        self._next += n
        emg = np.empty((n, len(self._rngs)))
        for muscle, (_, still) in enumerate(self._rngs):
            toward = torque_nm if muscle % 2 == 0 else -torque_nm
            hum = np.sin(2.0 * math.pi * HUM_HZ * time_s + self._phases_rad[muscle])
            emg[:, muscle] = self._gain * np.maximum(toward, 0.0) * self._noise(muscle, n)
            emg[:, muscle] += _V_PER_UV * s.virtual_noise_uv * still.standard_normal(n)
            emg[:, muscle] += _V_PER_UV * s.virtual_hum_uv * hum
        return emg

    def _noise(self, muscle: int, n: int) -> Array:
        """Return the next samples of noise in the band; its variance is the filter's energy."""
        white = self._rngs[muscle][0].standard_normal(n)
        noise, self._memories[muscle] = scipy.signal.sosfilt(
            self._sos, white, zi=self._memories[muscle]
        )
        return np.asarray(noise)


class VirtualMuscles:
    """The EMG of a session on the virtual rig, from what was recorded of its ticks.

    The subject's torque is drawn a second time from the session's seed, so the rig does nothing
    for it. Sample k was taken at k / `emg.rate_hz` since the session's start.

    Parameters
    ----------
    settings : Settings
    before : SubjectSettings
        The subject until the first epoch.
    """

    def __init__(self, settings: Settings, before: SubjectSettings) -> None:
        rng = np.random.default_rng(settings.seed)
        self._settings = settings
        self._rng = rig_streams(rng).subject
        self._emg = VirtualEmg(settings.emg, rng.spawn(1)[0])
        self._set_subject(before)
        self._tick, self._epoch = 0, -1
        self._torque_nm = [0.0]  # at the last tick, and before the first
        self._samples = 0

    def take(
        self, tick: NDArray[np.int64], epoch: NDArray[np.int64], of: Mapping[int, str]
    ) -> Array:
        """Return the EMG up to the last of these ticks, shape (n, muscles).

        Parameters
        ----------
        tick, epoch : array of int, shape (m,)
            Columns of the samples that follow those of the last call.
        of : mapping of int to str
            The condition of each epoch.
        """
        if not tick.size:
            return self._emg.block(np.empty(0))
        first = self._tick
        torques = [np.array(self._torque_nm)]
        for part in np.split(np.arange(tick.size), np.flatnonzero(np.diff(epoch)) + 1):
            number = int(epoch[part[0]])
            if number >= 0 and number != self._epoch:
                self._epoch = number
                self._set_subject(self._settings.subject[of[number]])
            steps = int(tick[part[-1]]) - self._tick
            torques.append(np.fromiter(islice(self._flow, steps), np.float64, steps))
            self._tick += steps
        torque = np.concatenate(torques)
        self._torque_nm = [float(torque[-1])]
        rate_hz, tick_rate_hz = self._settings.emg.rate_hz, self._settings.rig.tick_rate_hz
        until = math.floor(self._tick / tick_rate_hz * rate_hz) + 1
        at = np.arange(self._samples, until) / rate_hz * tick_rate_hz
        self._samples = until
        return self._emg.block(np.interp(at, np.arange(first, self._tick + 1), torque))

    def _set_subject(self, subject: SubjectSettings) -> None:
        """Begin a subject as the virtual rig does: one that stays the same goes on."""
        if getattr(self, "_subject", None) is subject:
            return
        self._subject = subject
        torque = SubjectTorque(subject, self._settings.rig.tick_rate_hz, self._rng.spawn(1)[0])
        self._flow = one_by_one(torque.block)
