"""Epochs with what methods, checks and figures make of them, each made once.

Whoever analyses holds the prepared epochs as long as they are needed; nothing is kept elsewhere.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

from rigidimeter.analysis.estimation.active_stretches import activities
from rigidimeter.analysis.estimation.bad_stretches import without_bad_stretches
from rigidimeter.analysis.estimation.closedloop.drive_fit import FoundDrive, fit_drive
from rigidimeter.analysis.estimation.screening import before_fit
from rigidimeter.analysis.estimation.signals import Signals
from rigidimeter.core.records import Activity, Channel, Epoch, Outcome
from rigidimeter.core.settings import EstimationSettings, Settings
from rigidimeter.model import DriveModel

MOST_TRIED = 5
"""So many epochs of a source may fail to show the drive before it is taken for unknown."""

T = TypeVar("T")

SignalsOf = Callable[[Epoch, EstimationSettings, DriveModel | None], Signals]


class Source:
    """The epochs of one recording, the drive that they show, and what they have in common."""

    def __init__(self, epochs: Sequence[Epoch], settings: Settings) -> None:
        self._epochs = epochs
        self._settings = settings
        self._made: dict[Hashable, Any] = {}

    @cached_property
    def drive(self) -> FoundDrive | None:
        """The drive, identified from the first epoch that allows it; None where it is unknown."""
        rig = self._settings.rig
        start = DriveModel.second_order(rig.drive_bandwidth_hz, rig.drive_damping_ratio)
        sound = (
            epoch
            for epoch in self._epochs
            if epoch.closed.included and not before_fit(epoch, self._settings.estimation)
        )
        for _, epoch in zip(range(MOST_TRIED), sound, strict=False):
            if (found := fit_drive(epoch, start)) is not None:
                return found
        return None

    def once(self, key: Hashable, make: Callable[[], T]) -> T:
        """Return what `make` gives, made when it is first asked for under this key."""
        if key not in self._made:
            self._made[key] = make()
        found: T = self._made[key]
        return found


@dataclass(frozen=True, eq=False)
class PreparedEpoch:
    """One epoch with what was made of it.

    Attributes
    ----------
    epoch : Epoch
    settings : Settings
    source : Source
        That all epochs of its recording share.
    activity : Activity or None
        What the EMG shows; None without EMG.
    with_active : Epoch or None
        The epoch with the stretches that are left out for an active muscle; None where none is.
    """

    epoch: Epoch
    settings: Settings
    source: Source
    activity: Activity | None = None
    with_active: Epoch | None = None
    _made: dict[Hashable, Any] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def obstacle(self) -> str:
        """Why the epoch cannot be fitted by any method, or an empty text."""
        return before_fit(self.epoch, self.settings.estimation)

    def once(self, make: Callable[..., T], *helped: object) -> T:
        """Return ``make(self, *helped)``, made when it is first asked for.

        What helps saves work and changes nothing.
        """
        if make not in self._made:
            self._made[make] = make(self, *helped)
        found: T = self._made[make]
        return found

    def signals(self, of: SignalsOf) -> Signals:
        """Return the signals that `of` makes of epoch, settings and drive, when first asked for.

        Raises
        ------
        ValueError
            If the epoch cannot be fitted; the text says why.
        """
        if self.obstacle:
            raise ValueError(self.obstacle)
        if of not in self._made:
            found = self.source.drive
            drive = found.model if found is not None else None
            self._made[of] = of(self.epoch, self.settings.estimation, drive)
        signals: Signals = self._made[of]
        return signals

    def moved(self, delay_s: float) -> PreparedEpoch:
        """Return the epoch with its torque this much earlier; nothing is made of it yet."""
        whole = self.with_active and torque_earlier(self.with_active, delay_s)
        return replace(self, epoch=torque_earlier(self.epoch, delay_s), with_active=whole)

    def closed_as(self, outcome: Outcome) -> PreparedEpoch:
        """Return the epoch with another outcome, and with all that was made of it."""
        other = replace(self, epoch=replace(self.epoch, closed=outcome))
        other._made.update(self._made)
        return other


def prepare(
    epochs: Iterable[Epoch], settings: Settings, *, screen: bool = True
) -> list[PreparedEpoch]:
    """Return the epochs ready to be fitted; those of one recording share their `Source`.

    Parameters
    ----------
    epochs : iterable of Epoch
    settings : Settings
    screen : bool
        Leave out the stretches in which a sensor did not measure, or a muscle was active.
    """
    recorded = list(epochs)
    if not screen:
        sources = _sources(recorded, settings)
        return [PreparedEpoch(epoch, settings, sources[epoch.source]) for epoch in recorded]
    measured = [without_bad_stretches(epoch, settings) for epoch in recorded]
    found = activities(recorded, measured, settings)
    sources = _sources([epoch for epoch, _ in found], settings)
    return [
        PreparedEpoch(
            epoch, settings, sources[epoch.source], activity, whole if epoch is not whole else None
        )
        for whole, (epoch, activity) in zip(measured, found, strict=True)
    ]


def _sources(epochs: Iterable[Epoch], settings: Settings) -> dict[str, Source]:
    by_source: dict[str, list[Epoch]] = {}
    for epoch in epochs:
        by_source.setdefault(epoch.source, []).append(epoch)
    return {name: Source(own, settings) for name, own in by_source.items()}


def drive_followed(prepared: PreparedEpoch) -> bool:
    """Return whether the motion between the samples is that of a known drive and its command."""
    known = prepared.source.drive is not None
    return known and "velocity_command_rad_s" in prepared.epoch.channels


def torque_earlier(epoch: Epoch, delay_s: float) -> Epoch:
    """Return the epoch with its torque this much earlier."""
    torque = epoch.channels.get("torque_nm")
    if torque is None:
        return epoch
    earlier = Channel(torque.name, torque.time_s - delay_s, torque.values)
    return replace(epoch, channels={**epoch.channels, torque.name: earlier})
