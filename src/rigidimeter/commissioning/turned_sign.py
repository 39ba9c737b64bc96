"""How soon the guard finds a torque sensor of the wrong sign, in simulated epochs.

The guard's test (`guard.torque_sign`) is of the last n rows, one every 16 to 20 ms. Let S be the
mean square, in a row, of the torque that the perturbation causes, and N that of all other torque,
the subject's own and the sensor's noise, both made white by an autoregression of order p. The
likelihoods of the two signs then have the ratio

    Λ = (1 + (S/N) n/f)^(n/2)        f = n − 4 − 2 p

which grows with the time, and the wrong sign is found where Λ^(−2/n) < x_n, that is

    S/N > (f/n) (1/x_n − 1)          11.7 in 24 rows (0.4 s), 2.19 in 48, 0.75 in 96 (1.5 s)

(half of all windows need 1.2 to 1.4 times as much, as the noise differs). With less than in the
longest window it is found by chance or never. S grows as the square of the perturbation's amplitude
and N as that of the subject's own torque, so that only the ratio of the two matters while no limit
is reached. But with the wrong sign the admittance is

    (J_c − J) θ'' + (B_c − B) θ' − K θ = M_p

and drives the arm away, about as e^(t K/(B_c − B)), to a limit, where it hardly moves. So a larger
perturbation is not always better, and epochs are simulated: the loop and the guard themselves on
the virtual rig, with the settings of the rig that is checked and the noise measured on it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from rigidimeter.acquisition import Clock, ControlLoop, SimulatedClock, perturb
from rigidimeter.devices import SimulatedRig
from rigidimeter.devices.base import Reading
from rigidimeter.experiment import prbs_nm
from rigidimeter.guard import Cause
from rigidimeter.settings import Settings

EPOCHS = 10
LONGEST_S = 4.0
"""So long at most is an epoch simulated: later, the arm has long been where it should not be."""

OWN_SHARES = (0.0, 0.05, 0.1, 0.2)
"""The subject's own torque (SD), as parts of the perturbation's amplitude."""

LARGER = (2.0, 3.0, 4.0)
"""Times the amplitude, tried where the amplitude of the settings is not enough."""


class TurnedRig(SimulatedRig):
    """The simulated rig whose torque has the wrong sign from one of its ticks on."""

    turned_at = math.inf

    def read(self, elapsed_ticks: int = 1) -> Reading:
        """Return the reading, its torque perhaps turned."""
        reading = super().read(elapsed_ticks)
        if self._tick > self.turned_at:
            return reading._replace(torque_nm=-reading.torque_nm)
        return reading


class TurnedEpoch(NamedTuple):
    """What ended an epoch, when, and the angle at each tick."""

    cause: Cause
    ended_s: float
    angle_deg: NDArray[np.float64]


class TurnedEpochs(NamedTuple):
    """What became of epochs with the wrong sign from the start.

    Attributes
    ----------
    condition : str
        Of the subject.
    own_torque_nm, amplitude_nm : float
        Standard deviation of the subject's own torque; amplitude of the perturbation.
    farthest_deg : float
        How far the arm was from the middle, at most.
    ended_s : mapping
        When the epochs ended, for each cause; `Cause.NONE` where none did before `LONGEST_S`.
    """

    condition: str
    own_torque_nm: float
    amplitude_nm: float
    farthest_deg: float
    ended_s: Mapping[Cause, Sequence[float]]

    @property
    def epochs(self) -> int:
        """How many there were."""
        return sum(len(ends) for ends in self.ended_s.values())

    @property
    def found_s(self) -> Sequence[float]:
        """When the sign was found, in the epochs in which it was."""
        return self.ended_s.get(Cause.TORQUE_SIGN, ())

    @property
    def median_s(self) -> float:
        """The median of `found_s`; NaN if it was never found."""
        return float(np.median(self.found_s)) if self.found_s else math.nan

    @property
    def all_found(self) -> bool:
        """Whether the sign was found in every one."""
        return len(self.found_s) == self.epochs


class Search(NamedTuple):
    """How the sign is found with each of the subjects' own torques, and what would do better.

    `larger` are epochs of a larger perturbation in which the sign was always found where it was not
    with that of the settings; None where all was found, or nothing tried was enough.
    """

    tried: tuple[TurnedEpochs, ...]
    larger: TurnedEpochs | None


def turned_epoch(
    settings: Settings,
    condition: str,
    seed: int,
    turned_s: float,
    longest_s: float,
    clock: Clock | None = None,
) -> TurnedEpoch:
    """Run one PRBS epoch from rest on the virtual rig, its torque turned from `turned_s` on.

    No tick is late unless the clock is.
    """
    rate_hz = settings.rig.tick_rate_hz
    rig = TurnedRig(settings.rig, settings.subject[condition], np.random.default_rng(seed))
    rig.turned_at = turned_s * rate_hz
    angles: list[float] = []
    clock = clock or SimulatedClock()
    loop = ControlLoop(settings, rig, clock, lambda s: angles.append(s.angle_rad))
    rig.enable()
    perturb(loop, 0, prbs_nm(settings.prbs, rate_hz)[: round(longest_s * rate_hz)].tolist())
    return TurnedEpoch(loop.cause, loop.tick / rate_hz, np.degrees(angles))


def turned_epochs(settings: Settings, condition: str, own_torque_nm: float) -> TurnedEpochs:
    """Run epochs of a subject with so much torque of its own, the sign wrong from the start."""
    subject = settings.subject[condition].model_copy(update={"voluntary_sd_nm": own_torque_nm})
    chosen = settings.model_copy(update={"subject": {condition: subject}})
    ended_s: dict[Cause, list[float]] = {}
    farthest_deg = 0.0
    for seed in range(EPOCHS):
        epoch = turned_epoch(chosen, condition, seed, 0.0, LONGEST_S)
        ended_s.setdefault(epoch.cause, []).append(epoch.ended_s)
        farthest_deg = max(farthest_deg, float(np.abs(epoch.angle_deg).max()))
    amplitude_nm = settings.prbs.amplitude_nm
    return TurnedEpochs(condition, own_torque_nm, amplitude_nm, farthest_deg, ended_s)


def perturbed_conditions(settings: Settings) -> list[str]:
    """Return the conditions of which the protocol has a torque perturbation."""
    blocks = settings.protocol.blocks
    return list(dict.fromkeys(block.condition for block in blocks if block.task == "prbs"))


def search_for_turned_sign(
    settings: Settings,
    noise_nm: float | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Search:
    """Return how the sign is found, for more and more own torque until it is not.

    Parameters
    ----------
    settings : Settings
        Of the protocol and the rig.
    noise_nm : float, optional
        Of the torque sensor (SD), as measured on the rig; else that of the settings.
    progress : callable
        Called with the share that was done since of all that may have to be tried.
    """
    if noise_nm is not None:
        torque = settings.rig.torque.model_copy(update={"noise_sd_nm": noise_nm})
        rig = settings.rig.model_copy(update={"torque": torque})
        settings = settings.model_copy(update={"rig": rig})
    conditions = perturbed_conditions(settings)
    share = 1.0 / (len(conditions) * (len(OWN_SHARES) + 1) + len(LARGER))
    tried: list[TurnedEpochs] = []
    for condition in conditions:
        for epochs in _until_hidden(settings, condition):
            tried.append(epochs)
            progress(share)
    hidden = [epochs for epochs in tried if not epochs.all_found]
    if not hidden:
        return Search(tuple(tried), None)
    least = min(hidden, key=lambda epochs: epochs.own_torque_nm)
    larger = (
        turned_epochs(_with_amplitude(settings, nm), least.condition, least.own_torque_nm)
        for nm in (factor * settings.prbs.amplitude_nm for factor in LARGER)
        if nm < settings.guard.torque_limit_nm
    )
    return Search(tuple(tried), next((epochs for epochs in larger if epochs.all_found), None))


def _until_hidden(settings: Settings, condition: str) -> Iterator[TurnedEpochs]:
    """Yield the epochs for each own torque up to the first that hides the sign in one of them."""
    planned_nm = settings.subject[condition].voluntary_sd_nm
    shares_nm: Sequence[float] = [share * settings.prbs.amplitude_nm for share in OWN_SHARES]
    for own_torque_nm in sorted({planned_nm, *shares_nm}):
        epochs = turned_epochs(settings, condition, own_torque_nm)
        yield epochs
        if not epochs.all_found:
            return


def _with_amplitude(settings: Settings, amplitude_nm: float) -> Settings:
    prbs = settings.prbs.model_copy(update={"amplitude_nm": amplitude_nm})
    return settings.model_copy(update={"prbs": prbs})
