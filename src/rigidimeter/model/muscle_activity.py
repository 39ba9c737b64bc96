"""EMG of the virtual subject: noise in 20–450 Hz whose amplitude follows the torque it makes.

The EMG of a muscle is, with w Gaussian, confined to 20–450 Hz and of unit variance, and n white,

    emg(t) = a · max(±M(t + d), 0) · w(t) + b · n(t) + h · sin(2π · 50 Hz · t + φ)

with + for muscles that drive the joint toward positive angles. M is the torque of the muscles, be
it voluntary, tremor or reflex; it comes the electromechanical delay d after the EMG. M comes before
the joint, so a muscle is active in proportion to what the subject does, not to how the joint
answers.

Surface EMG as Gaussian noise whose SD is the muscle's activation: Hogan and Mann, IEEE Trans Biomed
Eng 27:382 (1980). An electromechanical delay of 50 ms at the elbow: Cavanagh and Komi, Eur J Appl
Physiol 42:159 (1979).
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

    def until(self, time_s: Array, torque_nm: Array) -> Array:
        """Return the next samples whose torque is known, shape (n, muscles).

        Sample k was taken at k / `rate_hz`; the last is `virtual_delay_s` before the last torque.

        Parameters
        ----------
        time_s : array, shape (m,)
            Of each torque, from where the last call ended, or 0.
        torque_nm : array, shape (m,)
            Of the muscles, toward positive angles.
        """
        rate_hz, delay_s = self._settings.rate_hz, self._settings.virtual_delay_s
        stop = max(math.ceil((time_s[-1] - delay_s) * rate_hz) + 2, self._next)
        at_s = np.arange(self._next, stop) / rate_hz + delay_s
        return self.block(np.interp(at_s[at_s <= time_s[-1]], time_s, torque_nm))

    def block(self, torque_nm: Array) -> Array:
        """Return the next samples, shape (n, muscles).

        Parameters
        ----------
        torque_nm : array, shape (n,)
            That each sample makes, `virtual_delay_s` later.
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
    The torque of the ticks shows the EMG up to `emg.virtual_delay_s` before the last of them.

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

    def take(
        self, tick: NDArray[np.int64], epoch: NDArray[np.int64], of: Mapping[int, str]
    ) -> Array:
        """Return the EMG that these ticks show, shape (n, muscles).

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
        time_s = np.arange(first, self._tick + 1) / self._settings.rig.tick_rate_hz
        return self._emg.until(time_s, torque)

    def _set_subject(self, subject: SubjectSettings) -> None:
        """Begin a subject as the virtual rig does: one that stays the same goes on."""
        if getattr(self, "_subject", None) is subject:
            return
        self._subject = subject
        torque = SubjectTorque(subject, self._settings.rig.tick_rate_hz, self._rng.spawn(1)[0])
        self._flow = one_by_one(torque.block)
