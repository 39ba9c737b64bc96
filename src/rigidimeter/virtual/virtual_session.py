"""One session: compose the virtual rig, the loop and the recorder."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import asdict
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from rigidimeter.analysis.reading import Recording, read
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import EmgLog, PlannedEpoch, SessionWriter, read_session_files
from rigidimeter.core.settings import Settings, SubjectSettings, settings_from
from rigidimeter.model import VirtualMuscles
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import DeadlineClock, SessionResult, SimulatedClock, run_session
from rigidimeter.rig.devices import SimulatedRig


def session_length_s(settings: Settings) -> float:
    """Return how long the session of these settings lasts, in s."""
    return plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed).total_s


def simulate(
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
    out: str | PathLike[str] | None = None,
    *,
    seed: int | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Recording:
    """Run a protocol on the virtual rig, as fast as it goes, and return what was recorded.

    Parameters
    ----------
    settings : Settings, path or mapping, optional
        Settings, a TOML file of them, or their tables. Without any: four PRBS and four sinusoidal
        epochs in OFF.
    out : path, optional
        New folder for the session; without one nothing stays on disk.
    seed : int, optional
        Of everything random, instead of that of the settings.
    progress : callable
        Takes the session time in s, about once a second of it.

    Raises
    ------
    UserError
        If the settings are wrong, the folder cannot be written, or the session fails.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> blocks = [{"task": "prbs", "condition": "OFF", "epochs": 1}]
    >>> settings = {"prbs": {"duration_s": 6.0}, "protocol": {"blocks": blocks}}
    >>> recording = rm.simulate(settings, seed=1)
    >>> [(epoch.label, epoch.condition) for epoch in recording.epochs]
    [('1', 'OFF')]
    """
    settings = settings_from(settings)
    if seed is not None:
        settings = settings.model_copy(update={"seed": seed})
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "session" if out is None else Path(out)
        result = run_virtual_session(settings, folder, progress=progress)
        if result.outcome != "success":
            raise UserError(f"{folder}: the session ended with {result.outcome}: {result.reason}")
        return read(folder)


def run_virtual_session(
    settings: Settings,
    folder: Path,
    *,
    real_time: bool = False,
    progress: Callable[[float], None] = lambda _: None,
    created_utc: str = "",
    about: Mapping[str, Any] | None = None,
) -> SessionResult:
    """Run the protocol of the settings on the virtual rig and record it.

    All random numbers come from `settings.seed`: the same settings give the same samples, byte for
    byte, unless the clock is real.

    Parameters
    ----------
    settings : Settings
    folder : Path
        Made if it does not exist; it must be empty.
    real_time : bool
        Keep real time instead of as fast as it goes.
    progress : callable
        Takes the session time in s, about once a second of it.
    created_utc : str
        When the session took place, for its manifest; now if empty. A planned day has a date of
        its own, and with it the whole folder is the same byte for byte.
    about : mapping, optional
        What its manifest says of subject, day and plan.

    Raises
    ------
    UserError
        If the folder is not empty or cannot be written.
    """
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    first = settings.subject[protocol.epochs[0].condition]
    rig = SimulatedRig(settings.rig, first, np.random.default_rng(settings.seed))
    writer = SessionWriter(
        folder,
        settings,
        [asdict(epoch) for epoch in protocol.epochs],
        {"session": settings.seed},
        virtual=True,
        about=about,
        created_utc=created_utc,
        repeatable=not real_time,
    )

    def new_joint(planned: PlannedEpoch) -> dict[str, Any]:
        return {"true_joint": asdict(rig.new_epoch(settings.subject[planned.condition]))}

    result = run_session(
        protocol,
        settings,
        rig,
        DeadlineClock() if real_time else SimulatedClock(),
        writer,
        before_epoch=new_joint,
        progress=progress,
    )
    if settings.emg.channels:
        _write_emg(folder, settings, first, writer.session_id)
    return result


def _write_emg(folder: Path, settings: Settings, first: SubjectSettings, session_id: str) -> None:
    """Write the EMG of the virtual subject beside the samples of a session."""
    files = read_session_files(folder, ("tick", "epoch"))
    started = (e for e in files.log.events if e.get("event") == "epoch_started")
    conditions = {event["epoch"]: event["condition"] for event in started}
    tick, epoch = files.samples.columns["tick"], files.samples.columns["epoch"]
    emg_v = VirtualMuscles(settings, first).take(tick, epoch, conditions)
    log = EmgLog(folder, settings.emg.channels, settings.emg.rate_hz, session_id)
    time_s = np.arange(len(emg_v)) / settings.emg.rate_hz
    batch = round(settings.emg.rate_hz)
    for k in range(0, time_s.size, batch):
        log.append(time_s[k : k + batch], 0.0, emg_v[k : k + batch])
    log.close()
