"""A session in real time from its plan to its end, whoever leads it: `run` and `console`."""

from __future__ import annotations

import importlib.util
import random
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from rigidimeter.cli.output import echo
from rigidimeter.cli.realtime_rig import run_loop
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import (
    Protocol,
    again,
    codes_of,
    count_epochs,
    drawn_codes,
    is_session,
    read_manifest,
    require_all,
    rest_of,
)
from rigidimeter.core.settings import Settings, changed_settings, load_settings
from rigidimeter.planning import Dose, dose_objection, dose_reached, plan
from rigidimeter.rig.acquisition.processes import (
    Ended,
    Realtime,
    RecordingPlan,
    SessionMemory,
    supervise,
)
from rigidimeter.rig.commissioning import (
    CommissioningRecord,
    as_measured,
    check_record,
    model_of_today,
    record_path,
    require_daily_check,
)
from rigidimeter.rig.console import SessionPlan, next_steps, resume_command
from rigidimeter.rig.devices import (
    STOP_LOW,
    MotionRange,
    RigFile,
    load_rig,
    open_emg,
    range_of,
    require_emg,
)
from rigidimeter.rig.guard import DriveModel

Console = Callable[[SessionMemory], object]


@dataclass(frozen=True)
class PlannedSession:
    """What is to be run.

    Attributes
    ----------
    settings : Settings
    protocol : Protocol
    continues : dict
        What the manifest says of the session that this one continues.
    done : int
        How many epochs that session did.
    about : dict
        What the operator said of subject, condition and stimulation.
    source : Path or None
        The file of the settings.
    drive_model : DriveModel or None
        What commissioning found of the drive's side; None before the rig is checked, and where
        the guard does not compare the torque sensor with the drive's own torque.
    """

    settings: Settings
    protocol: Protocol
    continues: Mapping[str, Any] = field(default_factory=dict)
    done: int = 0
    about: Mapping[str, Any] = field(default_factory=dict)
    source: Path | None = None
    drive_model: DriveModel | None = None

    def shown(self, *, virtual: bool) -> SessionPlan:
        """Return the plan as consoles take it, with the codes of a blinded session."""
        codes = codes_of(self.about)
        raters = tuple(self.about.get("plan", {}).get("raters", "").split())
        return SessionPlan(self.settings, self.protocol.epochs, self.done, codes, virtual, raters)

    @property
    def motion_range(self) -> MotionRange | None:
        """The range of motion of the person, as it was entered for this session."""
        return range_of(self.about.get("range"), str(self.source or "the session"))

    def within(self, entered: MotionRange | None) -> PlannedSession:
        """Return the session within a range, where one was entered."""
        if entered is None:
            return self
        entered = replace(entered, subject=str(self.about.get("subject", "")))
        return self.with_about({"range": entered.facts()})

    def without_subject(self) -> PlannedSession:
        """Return the session as one of an axis on which nobody is."""
        nobody = {"diagnostics": {"subject_present": False}}
        return replace(self, settings=changed_settings(self.settings, nobody))

    def with_about(self, more: Mapping[str, Any]) -> PlannedSession:
        """Return the session with more that is said of it; what was entered before stays."""
        return replace(self, about={**self.about, **more})

    @property
    def dose_before(self) -> Dose:
        """What the sessions did that this one continues."""
        return Dose.of_record(self.continues.get("dose", {}))

    def blinded(self) -> PlannedSession:
        """Return the session with codes for its conditions, which one that has them keeps."""
        if self.about.get("codes"):
            return self
        names = [epoch.condition for epoch in self.protocol.epochs]
        codes = drawn_codes(names, random.SystemRandom())
        return self.with_about({"blinded": True, "codes": codes})


def new_session(
    settings: Settings, about: Mapping[str, Any], source: Path | None
) -> PlannedSession:
    """Return a new session of these settings."""
    planned = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    return PlannedSession(settings, planned, about=about, source=source)


def rest_of_session(
    resume: Path, *, virtual: bool, epoch: int | None = None, left: Collection[int] = ()
) -> PlannedSession:
    """Return what is left of a session, of that the epochs `left` if any, or one epoch again.

    Raises
    ------
    UserError
        If nothing is left, or it was recorded on another kind of rig.
    """
    rest = rest_of(resume) if epoch is None else again(resume, epoch)
    if left:
        epochs = tuple(one for one in rest.epochs if one.number in left)
        rest = replace(rest, epochs=epochs, done=rest.done + len(rest.epochs) - len(epochs))
    if rest.virtual != virtual:
        raise UserError(
            f"{resume}: was recorded on "
            + (
                "the virtual rig and can only be continued there; leave out --rig"
                if rest.virtual
                else "hardware and can only be continued there; name its rig file with --rig "
                "RIG.toml"
            )
        )
    if not rest.epochs:
        raise UserError(f"{resume}: nothing is left to run, all {rest.done} epochs are done")
    echo(f"{rest.done} epochs are done; {len(rest.epochs)} are left")
    protocol = Protocol(rest.settings.seed, rest.epochs, rest.settings.protocol.return_s)
    return PlannedSession(rest.settings, protocol, rest.continues, rest.done, rest.about)


def checked_rig(planned: PlannedSession, rig: Path | None) -> PlannedSession:
    """Return the session as it can be run on the rig.

    What is wrong with the rig or its record is said before any process starts, and so is that
    another has the rig; the loop's process then claims it.

    Raises
    ------
    UserError
        If the protocol asks for more than the dose of one session, or the rig was not commissioned
        or not checked, or another program has it, or the range of motion is missing, of another
        subject, beyond the stops or without the virtual joint's angle.
    """
    if too_much := _beyond_dose(planned):
        raise UserError(f"{planned.source or 'the session'}: {too_much}")
    if rig is None:
        # Imported late: it loads what only a check needs.
        from rigidimeter.cli.virtual_check import measured_drive_side

        found = planned.motion_range
        if found is not None and not found.low_deg < 0.0 < found.high_deg:
            raise UserError(
                f"{found.words}: the joint of the virtual rig stands at 0 deg, which must be "
                "between both ends"
            )
        return replace(planned, drive_model=measured_drive_side(planned.settings))
    rigfile, settings = load_rig(rig), planned.settings
    commissioned = check_record(rigfile, None, settings)
    today = require_daily_check(rigfile, commissioned, settings, settings_path=planned.source)
    rigfile.claim().close()
    model = model_of_today(commissioned.numbers, today.numbers)
    settings = as_measured(settings, commissioned, today)
    planned = replace(planned, settings=settings, drive_model=model)
    _require_range(planned, rigfile, commissioned)
    return planned


def _require_range(
    planned: PlannedSession, rigfile: RigFile, commissioned: CommissioningRecord
) -> None:
    """Refuse a rig of hardware without the range of motion of the person, or with a wrong one."""
    found, where = planned.motion_range, rigfile.path
    if found is None:
        if rigfile.emulated:
            return
        raise UserError(
            f"{where}: is hardware, so the range of motion of this person is needed: lead the arm "
            "through it with --lead-range, or give it on the drive's scale with --range-deg LOW "
            "HIGH; on the page enter it in the form"
        )
    subject = str(planned.about.get("subject", ""))
    if found.subject != subject:
        raise UserError(
            f"{where}: this is the range of motion of {found.subject or 'nobody'}, and "
            f"the subject is {subject or 'not named'}; lead this person's arm through its range"
        )
    echo(found.words[:1].upper() + found.words[1:] + ".", err=True)
    if rigfile.emulated and STOP_LOW not in commissioned.numbers:
        return  # nobody was there to lead it to its stops
    if not rigfile.absolute_angle:
        raise UserError(
            f"{where}: does not say absolute_angle = true, and without it a range of motion may "
            "mean another place after the drive's power was off; use an absolute encoder, or home "
            "the drive whenever it is switched on, and then say so in the rig file"
        )
    found.require_inside(commissioned.numbers, str(record_path(where)))


def _beyond_dose(planned: PlannedSession) -> str:
    """Return why it must not begin; one that is continued runs until its dose is reached."""
    limits, protocol = planned.settings.dose, planned.protocol
    if not planned.continues:
        return dose_objection(limits, protocol)
    first_s = protocol.epochs[0].duration_s + protocol.return_s
    return dose_reached(limits, planned.dose_before, first_s)


def run_planned(
    planned: PlannedSession,
    out: Path,
    rig: Path | None,
    realtime: Realtime,
    console: Console,
    operator_seen_ns: Callable[[], int] | None = None,
) -> Ended:
    """Run a session that was checked, to its end.

    Raises
    ------
    UserError
        If EMG on a rig is to be that of the virtual subject.
    """
    virtual_emg = planned.settings.emg.source in ("none", "virtual")
    if rig is not None and planned.settings.emg.source == "virtual":
        raise UserError(
            'emg.source = "virtual" is the EMG of the virtual subject; on a rig it must be "lsl" '
            'or "daq", or the table [emg] be left out'
        )
    home_rad = planned.continues.get("origin_rad") if rig is not None else None
    range_rad = planned.motion_range.range_rad if planned.motion_range is not None else None
    recording = RecordingPlan(
        out,
        planned.settings,
        tuple(asdict(epoch) for epoch in planned.protocol.epochs),
        {"session": planned.settings.seed},
        virtual=rig is None,
        continues=planned.continues,
        about=planned.about,
    )
    return supervise(
        partial(
            run_loop,
            planned.settings,
            planned.protocol,
            rig,
            home_rad,
            range_rad,
            drive_model=planned.drive_model,
            dose_before=planned.dose_before,
        ),
        recording,
        realtime=realtime,
        console=console,
        operator_seen_ns=operator_seen_ns,
        open_emg=None if virtual_emg else open_emg,
    )


def planned_session(
    path: Path | None, resume: Path | None, seed: int | None, *, virtual: bool
) -> PlannedSession:
    """Return what is to be run: a new session, or the rest of one."""
    if resume is None:
        settings = load_settings(path)
        if seed is not None:
            settings = changed_settings(settings, {"seed": seed}, "the options")
        return new_session(settings, {}, path)
    if path is not None or seed is not None:
        raise UserError(
            "--resume uses the settings and the seed of that session; leave out "
            + (f"{path}" if path is not None else "--seed")
        )
    return rest_of_session(resume, virtual=virtual)


def offer_to_continue(out: Path) -> None:
    """Say how to continue if the folder holds a session that was interrupted."""
    if not is_session(out):
        return
    rest = rest_of(out)
    if rest.epochs:
        again = resume_command(out, None if rest.virtual else "RIG.toml", rest.about)
        raise UserError(
            f"{out}: holds a session of which {len(rest.epochs)} epochs are left; continue it with "
            f"`{again}`, or name a new folder"
        )


def conclude(ended: Ended, out: Path, rig: Path | None, *, nwb: bool) -> None:
    """Say how the session ended; a session that is not whole ends the program with status 1."""
    folder = ended.folder if ended.folder != out.absolute() else out
    good, of = count_epochs(folder)
    echo(f"{good} of {of} epochs completed; session in {folder}")
    if nwb:
        echo(write_nwb_beside(folder))
    closed = bool(ended.outcome)
    rest = rest_of(folder)
    steps = next_steps(
        folder,
        closed=closed,
        good=good,
        left=len(rest.epochs),
        rig=rig,
        about=rest.about,
    )
    echo("\n".join(["What to do next:", *(f"  {step}" for step in steps)]))
    if ended.outcome != "success":
        raise UserError(
            f"{folder}: the session ended with {ended.outcome or 'no outcome'}: {ended.reason}"
        )
    require_all(folder, good, of)


def require_packages(settings: Settings) -> None:
    """Refuse settings that need a package or a source of EMG that is not there, before it starts.

    Raises
    ------
    UserError
        With what would be right.
    """
    require_emg(settings.emg)
    needs = (
        ("lsl", settings.sharing.lsl, "pylsl", "lsl"),
        ("nwb_at_close", settings.sharing.nwb_at_close, "pynwb", "nwb"),
    )
    for key, wanted, package, extra in needs:
        if wanted and importlib.util.find_spec(package) is None:
            raise UserError(
                f"sharing.{key} = true needs one more package: pip install 'rigidimeter[{extra}]'"
            )


def write_nwb_beside(folder: Path) -> str:
    """Write `SESSION.nwb` beside a closed session, without estimates; return what came of it.

    A blinded session is written with its codes. The session is recorded whatever becomes of this,
    so a failure is a sentence.
    """
    # Not before the session: it begins without what it does not need.
    from rigidimeter.analysis.export import export_sessions, sessions_of_recording
    from rigidimeter.analysis.reading import read, with_codes

    out = folder.with_name(f"{folder.name}.nwb")
    try:
        blinded = bool(codes_of(read_manifest(folder).get("about", {})))
        recording = with_codes(read(folder)) if blinded else read(folder)
        export_sessions(sessions_of_recording(recording, None, blinded=blinded), "nwb", out)
    except UserError as error:
        return f"error: {out} was not written: {error}"
    return f"the same as NWB in {out}"
