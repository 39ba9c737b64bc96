"""`rigidimeter run` and `rigidimeter recover`: a session in real time, and closing a broken one."""

from __future__ import annotations

import sys
from pathlib import Path

from rigidimeter.cli.console import HOST, NO_TOKEN, PORT, TOKEN_FILE, require_page
from rigidimeter.cli.help_pages import OPTIONS, RUN, WRITE, argument
from rigidimeter.cli.options import CPU, PRIORITY, RIG, SEED
from rigidimeter.cli.output import echo
from rigidimeter.core.errors import UserError

_RANGE_FORM = "enter the range of motion of this person in the form of the page"
_ON_THE_PAGE = {
    "--range-deg": _RANGE_FORM,
    "--lead-range": _RANGE_FORM,
    "--blinded": "tick Blinded in the form of the page",
    "--confirm": "it is for --unattended, and somebody leads the page",
}
"""What to do on the page instead of giving an option."""


def run(
    out: Path | None = WRITE.option(
        "--out DIR", "New folder for the session. One of a plan is in its study."
    ),
    protocol: Path | None = argument("[PROTOCOL.toml]", "Settings with the protocol.", None),
    rig: Path | None = RIG,
    resume: Path | None = RUN.option(
        "--resume DIR", "Continue this session: run the epochs that are left."
    ),
    study: Path | None = RUN.option(
        "--next STUDY", "Run the session of this study's plan that is due, after its wait."
    ),
    block: str = RUN.further(
        "--block DAY/ORDER", "With --next: this session of the plan, not the one that is due.", ""
    ),
    subject: str = RUN.option("--subject CODE", "Code of the subject.", ""),
    operator: str = RUN.further("--operator NAME", "Who leads the session.", ""),
    day: str = RUN.further("--day LABEL", "Day of the study. Default: the date.", ""),
    note: str = RUN.further("--note TEXT", "Note on the session.", ""),
    stimulation: str = RUN.option(
        "--stimulation TEXT",
        "Of a planned session: on, off, or since when on the clock, as `off since 10:42`.",
        "",
    ),
    begin_anyway: str = RUN.further(
        "--begin-anyway REASON", "Begin a planned session before its wait is over. Recorded.", ""
    ),
    clock_speed: float = RUN.further(
        "--clock-speed X",
        "With --next on the virtual rig: waits pass so many times faster. Recorded.",
        1.0,
        min=1.0,
        max=100000.0,
    ),
    seed: int | None = SEED,
    unattended: bool = RUN.flag(
        "--unattended",
        "Run without an operator. What would pause the session ends it instead; hardware also "
        "needs --confirm.",
    ),
    confirm: str = RUN.option(
        "--confirm TEXT",
        'The words "nobody in the rig". With --unattended on hardware; recorded.',
        "",
    ),
    priority: int = PRIORITY,
    cpu: int | None = CPU,
    page: bool = RUN.flag(
        "--console", "Lead the session from a page in a browser. As `rigidimeter console` does."
    ),
    blinded: bool = RUN.flag(
        "--blinded",
        "Show codes in place of conditions. For an examiner who may see the screen; also with "
        "`estimate --blinded`.",
    ),
    range_deg: tuple[float, float] | None = RUN.option(
        "--range-deg LOW HIGH",
        "Range of motion of this person, on the drive's scale. Hardware needs it or --lead-range.",
    ),
    lead_range: bool = RUN.flag(
        "--lead-range",
        "Lead the arm to both ends of its range by hand, without power, before the session.",
    ),
    host: str = HOST,
    port: int = PORT,
    token_file: Path | None = TOKEN_FILE,
    no_token: bool = NO_TOKEN,
) -> None:
    """Run a protocol in real time, on a rig or the virtual rig.

    Loop, recorder and live estimate run in separate processes. With --rig, the rig must have been
    commissioned (`rigidimeter commission`) and checked within a day (`rigidimeter check`). Fit
    mechanical stops and a hardware enable before you rely on this program.

    The exit status is 1 if a planned epoch did not end with success, nor did its repetition.

    \b
    For example:
      rigidimeter run --out monday
      rigidimeter run examples/settings/human-elbow.toml --rig RIG.toml \\
          --lead-range --out tuesday
      rigidimeter run --resume tuesday --rig RIG.toml --out tuesday-2
      rigidimeter run --next demo-study --stimulation "on since 10:42"
    """
    from rigidimeter.cli.attendance import attendance
    from rigidimeter.cli.planned_session import (
        checked_rig,
        conclude,
        offer_to_continue,
        planned_session,
        require_packages,
        run_planned,
    )
    from rigidimeter.cli.range_entry import entered_range
    from rigidimeter.cli.session_of_plan import (
        SaidOfSession,
        next_session,
        refuse_with_next,
        refuse_without_next,
        rest_of_plan,
    )
    from rigidimeter.rig.acquisition.processes import Realtime, complete_left
    from rigidimeter.rig.console import discard_typed, terminal_view

    for line in complete_left():
        echo(line, err=True)
    said = SaidOfSession(
        subject, operator, note, stimulation, block, begin_anyway, clock_speed, day
    )
    due = None
    if study is not None:
        refuse_with_next(
            {
                "--out": out is not None,
                "PROTOCOL.toml": protocol is not None,
                "--resume": resume is not None,
                "--seed": seed is not None,
                "--day": bool(day),
                "--blinded": blinded,
                "--console": page,
            }
        )
        due = next_session(study, said, virtual=rig is None)
        planned = due.planned()
    else:
        if resume is None:
            refuse_without_next(said)
        planned = planned_session(protocol, resume, seed, virtual=rig is None)
        if resume is not None:
            due = rest_of_plan(resume, planned.about, said)
        planned = planned.with_about(said.facts())
    if due is not None:
        out = due.folder(out)
    if out is None:
        raise UserError("--out is needed: name a new folder for the session")
    require_packages(planned.settings)
    offer_to_continue(out)
    if page:
        require_page()
        if unattended or resume is not None:
            raise UserError(
                "--console goes with neither --unattended nor --resume; continue a session under "
                "After on the page of `rigidimeter console`"
            )
        of_the_form = {
            "--range-deg": range_deg is not None,
            "--lead-range": lead_range,
            "--blinded": blinded,
            "--confirm": bool(confirm),
        }
        for option, given in of_the_form.items():
            if given:
                raise UserError(f"{option} does not go with --console; {_ON_THE_PAGE[option]}")
        from rigidimeter.cli.page_session import PageAddress, serve_page
        from rigidimeter.rig.console.page import Place

        folder, source = out.absolute(), planned.source
        name = source.name if source is not None else "the defaults"
        place = Place(folder.parent, planned.settings, name, rig, folder.name, source)
        address = PageAddress(host, port, token_file, no_token)
        led = serve_page(place, Realtime(priority=priority, cpu=cpu), address)
        if led is None:
            raise UserError("the program was stopped before a session was run")
        conclude(led, out, rig, nwb=False)
        return
    planned = planned.blinded() if blinded else planned
    planned = planned.within(entered_range(range_deg, rig, planned.settings, lead=lead_range))
    planned = checked_rig(planned, rig)
    if due is not None:
        planned = planned.with_about(due.waited())
    attended, confirmed = attendance(rig, unattended=unattended, confirm=confirm)
    planned = planned.without_subject() if confirmed else planned
    shown = planned.shown(virtual=rig is None)
    realtime = Realtime(priority=priority, cpu=cpu, attended=attended, confirmed=confirmed)
    with terminal_view(sys.stdin if attended else None, sys.stdout, shown) as console:
        ended = run_planned(planned, out, rig, realtime, console)
    for remark in ended.remarks:
        echo(remark, err=True)
    if due is not None:
        due.add(ended.folder)
    try:
        conclude(ended, out, rig, nwb=planned.settings.sharing.nwb_at_close)
    finally:
        if attended:
            discard_typed(sys.stdin)


def recover(
    session: Path = argument("SESSION", "Session folder."),
    reason: str = OPTIONS.option(
        "--reason TEXT",
        "Why it ended, if you know.",
        "the recording process ended without closing the session",
    ),
    force: bool = OPTIONS.flag(
        "--force", "Also a session that was closed and is damaged at its end."
    ),
) -> None:
    """Close an interrupted session, keeping everything recorded.

    So is what is still in memory. Open epochs end with `fail` and the reason. A session that is
    closed already does not change, and one that a process still records is refused. Samples that a
    killed session left in memory are brought in, until the computer is switched off.

    \b
    For example:
      rigidimeter recover session
      rigidimeter recover session --reason "power cut"
    """
    from rigidimeter.core.session import recover as close_session
    from rigidimeter.rig.acquisition.processes import complete_left

    for line in complete_left(session, reason):
        echo(line, err=True)
    found = close_session(session, reason, force=force)
    for what in found.damaged:
        echo(f"error: {session}/{what} is damaged; it stays as it is", err=True)
    extent = f"{found.n_samples} samples up to {found.last_time_s:.3f} s"
    if found.already_closed:
        echo(f"{session} was closed already: {extent}")
        return
    epochs = ", ".join(found.epochs_closed) or "none"
    kept = " and ".join(found.torn_files)
    torn = f"; {found.torn_bytes} torn bytes of samples; stored in {kept}" if kept else ""
    echo(f"{session} is closed: {extent}; open epochs closed as failed: {epochs}{torn}")
