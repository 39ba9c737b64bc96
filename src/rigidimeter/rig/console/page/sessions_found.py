"""The folder of the console: its sessions, the study that they make, and their reports.

Nothing here changes a session. An epoch is left out of results by a row in `exclusions.csv`, as in
a study folder: path, epoch, reason, by. The samples stay as they are. The row of an epoch that is
included again becomes a comment that says when, by whom and why.

Of reports only folders that hold a `report.html` are served. A report comes with
`Content-Security-Policy: sandbox`, so whatever stands in it can neither read the operator's page
nor order anything.
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import (
    EVENTS,
    NO_CODE,
    codes_of,
    in_codes,
    locked,
    read_manifest,
    rest_of,
)
from rigidimeter.core.study_files import (
    SESSIONS,
    STUDY_FILE,
    ContinuedSession,
    ScannedSession,
    continued_session,
    exclude_epoch,
    excluded_epochs,
    extend_study,
    include_epoch,
    rate_session,
    raters_of,
    read_plan,
    read_study_toml,
    scan_session,
    session_folders,
)
from rigidimeter.rig.console.page.form_values import parse_line, parse_name, parse_number
from rigidimeter.rig.console.page.server_state import Place

MAX_SESSIONS = 200
NEVER_S = 1e9
"""When an epoch ended that nobody ended: later than any."""

PAGE = "report.html"
OF_STUDY = "report"
_FOR_SESSION = "-report"
POLICY = "sandbox allow-scripts allow-downloads allow-popups"


@dataclass(frozen=True)
class FoundEpoch:
    """An epoch that was begun; `excluded` is the reason why it is left out, and who said so.

    Of a session in which conditions were hidden, they stay so.
    """

    number: int
    label: str
    task: str
    condition: str
    outcome: str
    reason: str
    rating: str
    excluded: str
    begun_s: float = 0.0
    ended_s: float = NEVER_S


@dataclass(frozen=True)
class FoundSession:
    """A session folder, by its path; `outcome` is empty where the session was not closed.

    `raters` are those that a plan names. `left` are the numbers of the planned epochs that neither
    it nor a session that continues it ran, or will run.
    """

    name: str
    created_utc: str
    subject: str
    virtual: bool
    outcome: str
    reason: str
    planned: int
    recording: bool
    epochs: tuple[FoundEpoch, ...]
    session_id: str = ""
    continues: str = ""
    plan: tuple[int, ...] = ()
    left: tuple[int, ...] = ()
    blinded: bool = False
    raters: tuple[str, ...] = ()

    @property
    def unfinished(self) -> bool:
        """Whether it was interrupted, or epochs are left."""
        return not self.recording and (not self.outcome or bool(self.left))

    @property
    def good(self) -> int:
        """How many epochs ended with success."""
        return sum(epoch.outcome == "success" for epoch in self.epochs)

    @property
    def options(self) -> tuple[str, ...]:
        """Options of `estimate` and `report` that leave out the excluded epochs, and say why.

        Those of a blinded session hide its conditions, too.
        """
        words = ["--blinded"] if self.blinded else []
        for epoch in self.epochs:
            if epoch.excluded:
                words += ["--leave-out", f"{epoch.begun_s}:{epoch.ended_s} {epoch.excluded}"]
        return tuple(words)


def found_sessions(root: Path) -> tuple[list[FoundSession], list[str]]:
    """Return the sessions of a folder, newest first, and a sentence for each that is not read."""
    folders = sorted(session_folders(root), key=lambda path: path.stat().st_mtime, reverse=True)
    problems: list[str] = []
    try:
        excluded = excluded_epochs(root)
    except UserError as error:
        excluded, problems = {}, [str(error)]
    found = []
    for folder in folders[:MAX_SESSIONS]:
        try:
            found.append(_session(root, folder, excluded))
        except (UserError, OSError, KeyError, TypeError) as error:
            problems.append(f"{_name(root, folder)}: {error}")
    return [_with_left(one, root, found) for one in found], problems


def _name(root: Path, folder: Path) -> str:
    return folder.relative_to(root).as_posix()


def _with_left(one: FoundSession, root: Path, found: Sequence[FoundSession]) -> FoundSession:
    """Return a session with what is left of it."""
    if not one.outcome or one.good >= one.planned:
        return one
    continued = {
        number
        for other in found
        if one.session_id and other.continues == one.session_id
        for number in other.plan
    }
    try:
        rest = [epoch.number for epoch in rest_of(root / one.name).epochs]
    except UserError:  # such as one without a protocol
        rest = []
    return replace(one, left=tuple(number for number in rest if number not in continued))


def exclude(root: Path, session: str, epoch: str, reason: str, by: str) -> None:
    """Leave an epoch out of results, with a reason and a name.

    Raises
    ------
    UserError
        If there is no such epoch, it is left out already, or reason or name is missing.
    """
    found = _session(root, _folder(root, session), {})
    reason, by = _asked(reason, by)
    if epoch not in {one.label for one in found.epochs}:
        raise UserError(f"{session} has no epoch {epoch}")
    exclude_epoch(root, session, epoch, reason, by)


def include(root: Path, session: str, epoch: str, reason: str, by: str) -> None:
    """Include an epoch again that was left out; its row stays in the table as a comment.

    Raises
    ------
    UserError
        If it is not left out, or reason or name is missing.
    """
    include_epoch(root, _name(root, _folder(root, session)), epoch, *_asked(reason, by))


def _folder(root: Path, session: str) -> Path:
    """Return the folder of a session, which lies in no other place than the list's."""
    name = session.removeprefix(f"{SESSIONS}/")
    parse_name(name, "session")
    return root / session


def _asked(reason: str, by: str) -> tuple[str, str]:
    return parse_line(reason, "reason"), parse_line(by, "name", 40)


def _session(root: Path, folder: Path, excluded: dict[tuple[str, str], str]) -> FoundSession:
    if not (folder / EVENTS).is_file():
        raise UserError(f"has no {EVENTS}; put back a copy of it")
    one = scan_session(root, folder)
    manifest, about = one.manifest, one.about
    end: Mapping[str, Any] = next(iter(one.of("session_ended")), {})
    recording = False
    if not end:
        try:
            with locked(folder / EVENTS, ""):
                pass
        except UserError:
            recording = True
    plan = manifest["protocol"]
    return FoundSession(
        one.path,
        manifest["created_utc"],
        str(about.get("subject", "")),
        manifest["virtual"],
        end.get("outcome", ""),
        end.get("reason", "still being recorded" if recording else "it was interrupted"),
        len(plan),
        recording,
        tuple(_epochs(one, excluded)),
        manifest.get("session_id", ""),
        manifest.get("continues", {}).get("session_id", ""),
        tuple(entry["number"] for entry in plan),
        blinded=about.get("blinded") is True,
        raters=tuple(str(about.get("plan", {}).get("raters", "")).split()),
    )


def _epochs(one: ScannedSession, excluded: dict[tuple[str, str], str]) -> list[FoundEpoch]:
    codes = codes_of(one.about)
    ends = {event["epoch"]: event for event in one.of("epoch_ended")}
    ratings: dict[int, list[str]] = {}
    for event in one.of("note"):
        if event.get("what") == "rating":
            ratings.setdefault(event["epoch"], []).append(f"{event['score']:g} ({event['by']})")
    blinded = one.about.get("blinded")
    return [
        FoundEpoch(
            begun["epoch"],
            begun["label"],
            begun["task"],
            codes.get(begun["condition"], NO_CODE) if blinded else begun["condition"],
            ends.get(begun["epoch"], {}).get("outcome", ""),
            ends.get(begun["epoch"], {}).get("reason", "not ended"),
            "; ".join(ratings.get(begun["epoch"], ())),
            excluded.get((one.path, begun["label"]), ""),
            begun["time_s"],
            ends.get(begun["epoch"], {}).get("time_s", NEVER_S),
        )
        for begun in one.of("epoch_started")
    ]


def continued(root: Path, session: str) -> ContinuedSession | None:
    """Return what is left of a session of a plan; None for any other."""
    return continued_session(root / session, read_manifest(root / session).get("about", {}))


def extended(place: Place) -> list[str]:
    """Add what was recorded to the study of the console's folder; return what is to be said.

    A page for one session may lie in any folder, which is not made a study.
    """
    if place.one_session:
        return []
    codes: Mapping[str, str] = {}
    try:
        plan = read_plan(place.root)
        codes = {} if plan is None else plan.about.codes
        known = None if plan is not None else list(place.settings.subject)
        found = extend_study(place.root, known=known)
    except (UserError, OSError) as error:
        found = [f"not in the study: {error}"]
    return [in_codes(line, codes) for line in found]


def rate(place: Place, session: str, examiner: str, score: str) -> str:
    """Write a rating of a session into the study; return what is to be said of the score.

    Raises
    ------
    UserError
        If it cannot be read or written, or was given before.
    """
    value = parse_number(score, "score")
    rate_session(place.root, session, examiner, value)
    return off_scale(place, value)


def rated_words(root: Path, session: FoundSession) -> str:
    """Return who of the planned raters rated a session and who did not."""
    if not session.raters or not session.outcome:
        return ""
    try:
        scores = raters_of(root, session.name)
    except UserError as error:
        return str(error)
    parts = [f"{one}: {scores.get(one, 'not rated yet')}" for one in session.raters]
    return f"Ratings: {'; '.join(parts)}"


def off_scale(place: Place, score: float) -> str:
    """Return what is to be said of a score outside the study's scale; an empty text of others."""
    path = place.root / STUDY_FILE
    if place.one_session or not path.is_file():
        return ""
    try:
        low, high = read_study_toml(path).rating.scale
    except UserError:
        return ""  # the reading of the study says why
    if low <= score <= high:
        return ""
    return (
        f"noted, but {score:g} is outside the scale of {low:g} to {high:g} in {path}: rate the "
        "epoch again, or change `scale` there; the study cannot be compared until then"
    )


def report_folder(session: str = "") -> str:
    """Return the name of the folder in which a session's report lies, or that of the study."""
    return f"{session.replace('/', '-')}{_FOR_SESSION}" if session else OF_STUDY


def report_link(folder: str) -> str:
    """Return the address of a report, below that of the page."""
    return f"/report/{folder}/{PAGE}"


def report_file(root: Path, folder: str, path: str) -> Path | None:
    """Return a file of a report; None where there is none, or it lies elsewhere."""
    if folder != OF_STUDY and not folder.endswith(_FOR_SESSION):
        return None
    within = os.path.realpath(root / folder)
    found = os.path.realpath(os.path.join(within, path))
    inside = os.path.dirname(within) == os.path.realpath(root) and found.startswith(within + os.sep)
    report = Path(within, PAGE).is_file()
    return Path(found) if inside and report and os.path.isfile(found) else None
