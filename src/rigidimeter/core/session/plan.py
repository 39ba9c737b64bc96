"""What a session is to do, and what is left to do of one that was interrupted.

The conditions of a session whose examiner must not know them have codes in their place. These are
drawn before the session and are in its manifest (`about.codes`), beside the names: they keep a
condition off screens and pages, not from somebody who opens the files.
"""

from __future__ import annotations

import collections
import random
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from rigidimeter.core.errors import UserError
from rigidimeter.core.files import DOCUMENT_BYTES, read_bytes
from rigidimeter.core.records import Task
from rigidimeter.core.session.epochs import session_settings
from rigidimeter.core.session.event_log import read_events, scan_events
from rigidimeter.core.session.folder import EVENTS, check_session, locked, read_manifest
from rigidimeter.core.settings import Settings

NO_CODE = "(blinded)"
"""What is shown of a condition that has no code where others have one."""
_PLANNED: Mapping[str, type | tuple[type, ...]] = {
    "number": int,
    "label": str,
    "task": str,
    "condition": str,
    "duration_s": (int, float),
    "rest_s": (int, float),
}
_BY_GUARD = "the guard stopped the rig: "


@dataclass(frozen=True)
class PlannedEpoch:
    """One perturbation and the rest after it.

    Attributes
    ----------
    number : int
        Place in the session, from 1.
    label : str
        The number as text, the epoch's name in the recording.
    task : {"prbs", "sinusoid"}
        Which perturbation.
    condition : str
        For example ``OFF`` or ``DBS``.
    duration_s, rest_s : float
        Of the epoch, and of the rest after it.
    """

    number: int
    label: str
    task: Task
    condition: str
    duration_s: float
    rest_s: float


@dataclass(frozen=True)
class Protocol:
    """The epochs of a session in order, and the seed from which the rests came.

    Attributes
    ----------
    seed : int
    epochs : tuple of PlannedEpoch
    return_s : float
        The least time of the return after each epoch, before its rest.
    """

    seed: int
    epochs: tuple[PlannedEpoch, ...]
    return_s: float = 0.0

    @property
    def total_s(self) -> float:
        """How long the session takes, returns and the last rest included, in s."""
        return sum(epoch.duration_s + self.return_s + epoch.rest_s for epoch in self.epochs)

    @property
    def counts(self) -> dict[tuple[Task, str], int]:
        """How many epochs there are of each task and condition, in order of first appearance."""
        return dict(collections.Counter((epoch.task, epoch.condition) for epoch in self.epochs))


def drawn_codes(conditions: Sequence[str], rng: random.Random) -> dict[str, str]:
    """Return a code for each condition, in an order that the names do not tell.

    Examples
    --------
    >>> sorted(drawn_codes(["OFF", "DBS"], random.Random(1)).values())
    ['code-A', 'code-B']
    """
    names = list(dict.fromkeys(conditions))
    order = rng.sample(range(len(names)), len(names))
    return {name: f"code-{chr(ord('A') + k)}" for name, k in zip(names, order, strict=True)}


def codes_of(about: Mapping[str, Any]) -> dict[str, str]:
    """Return the codes that a manifest's `about` holds; empty where nobody was blinded."""
    codes = about.get("codes")
    return {str(name): str(code) for name, code in codes.items()} if codes else {}


def in_codes(text: str, codes: Mapping[str, str]) -> str:
    """Return a sentence with the codes of conditions in place of their names.

    Examples
    --------
    >>> in_codes("protocols/OFF.toml: has epochs of DBS", {"OFF": "code-B", "DBS": "code-A"})
    'protocols/code-B.toml: has epochs of code-A'
    """
    if not codes:
        return text
    names = "|".join(re.escape(name) for name in sorted(codes, key=len, reverse=True))
    return re.sub(rf"(?<!\w)({names})(?!\w)", lambda found: codes[found[1]], text)


@dataclass(frozen=True)
class Rest:
    """What is left of a session.

    Parameters
    ----------
    settings : Settings
        As the session was begun with.
    epochs : tuple of PlannedEpoch
        Those that were not run to their end, with their own numbers and rests.
    done : int
        How many epochs were run to their end.
    virtual : bool
        Whether it was recorded on the virtual rig.
    continues : dict
        What the manifest of the new session says of the old one; its `origin_rad`, where it is
        known, is where the joint stood when the first of them was begun, and its `dose` what all of
        them have done.
    about : dict
        What the operator said of subject, condition and stimulation.
    """

    settings: Settings
    epochs: tuple[PlannedEpoch, ...]
    done: int
    virtual: bool
    continues: dict[str, Any]
    about: dict[str, Any] = field(default_factory=dict)


def rest_of(folder: Path) -> Rest:
    """Return what is left of a session, however it ended.

    An epoch is done when it ended with success, or failed and the session continued: an arm that
    reached its limit would reach it again. So is one whose repetition is done. The epoch in which
    the session ended is repeated.

    Raises
    ------
    UserError
        If the folder is no session folder, was recorded without a protocol, or is still being
        recorded.
    """
    manifest = read_manifest(folder)
    events = _events(folder, manifest)
    planned: list[PlannedEpoch] = []
    for entry in manifest["protocol"]:
        try:
            planned.append(PlannedEpoch(**entry))
        except TypeError:
            raise _unplanned(folder, entry) from None
        if not all(isinstance(getattr(planned[-1], key), kind) for key, kind in _PLANNED.items()):
            raise _unplanned(folder, entry)
    if not planned:
        raise UserError(f"{folder}: the session has no protocol, so it cannot be continued")
    ended = [event for event in events if event.get("event") == "epoch_ended"]
    done = {event["epoch"] for event in ended if event["outcome"] == "success"}
    done |= {event["epoch"] for event in ended[:-1] if event["outcome"] == "fail"}
    if ended and ended[-1]["outcome"] == "fail" and _went_on(events, ended[-1]):
        done.add(ended[-1]["epoch"])
    done |= {event["epoch"] for event in ended if event.get("again_as") in done}
    # The first session sets the origin: otherwise the limits would drift from session to session.
    origins = [manifest.get("continues", {}), *events]
    for found in origins:
        origin_rad = found.get("origin_rad", 0.0)
        if isinstance(origin_rad, bool) or not isinstance(origin_rad, int | float):
            raise UserError(
                f"{folder}: origin_rad is {origin_rad!r}; it must be the angle in rad at which the "
                "session began"
            )
    origin = next(({"origin_rad": o["origin_rad"]} for o in origins if "origin_rad" in o), {})
    left = tuple(epoch for epoch in planned if epoch.number not in done)
    return Rest(
        session_settings(folder),
        left,
        len(planned) - len(left),
        manifest["virtual"],
        {
            "folder": folder.name,
            "session_id": manifest.get("session_id", ""),
            "created_utc": manifest["created_utc"],
            **origin,
            **_dose(manifest, ended),
        },
        dict(manifest.get("about", {})),
    )


def _dose(manifest: Mapping[str, Any], ended: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what was done up to the last epoch, with the sessions before, where it was counted."""
    counted = [manifest.get("continues", {}), *ended]
    doses = [found["dose"] for found in counted if isinstance(found.get("dose"), dict)]
    return {"dose": doses[-1]} if doses else {}


def again(folder: Path, number: int) -> Rest:
    """Return one epoch of a session, however it ended, to be run again.

    Raises
    ------
    UserError
        As `rest_of`, and if the session has no such epoch.
    """
    rest = rest_of(folder)
    for event in _events(folder, read_manifest(folder)):
        if event.get("event") == "epoch_started" and event["epoch"] == number:
            label = str(event["label"]).removesuffix("r")
            planned = (PlannedEpoch(**entry) for entry in read_manifest(folder)["protocol"])
            found = next((epoch for epoch in planned if epoch.label == label), None)
            if found is not None:
                return replace(rest, epochs=(found,), done=0)
    raise UserError(f"{folder}: no epoch {number} of its plan was run")


def _unplanned(folder: Path, entry: Any) -> UserError:
    return UserError(
        f"{folder}/manifest.json: protocol holds {str(entry)[:200]}, which is no planned epoch"
    )


def count_epochs(folder: Path) -> tuple[int, int]:
    """Return how many epochs of a session ended with success, and how many were planned."""
    events, _ = read_events(folder / EVENTS)
    good = sum(e.get("event") == "epoch_ended" and e["outcome"] == "success" for e in events)
    return good, len(read_manifest(folder)["protocol"])


def require_all(folder: Path, good: int, planned: int) -> None:
    """Refuse a session in which an epoch ended without success, as did its repetition.

    Raises
    ------
    UserError
        Says how many, and where the reasons are.
    """
    if good < planned:
        raise UserError(
            f"{folder}: {planned - good} of {planned} epochs did not end with success; "
            "events.jsonl holds the reason of each"
        )


def _events(folder: Path, manifest: dict[str, Any]) -> list[dict[str, Any]]:
    """Return the events of a session that nobody is recording any more."""
    path = folder / EVENTS
    if not path.is_file():
        return []
    with locked(path, "end that session first, then continue it"):
        log = scan_events(read_bytes(path, DOCUMENT_BYTES), path)
    check_session(folder, manifest, {EVENTS: log.session_ids})
    return log.events


def _went_on(events: list[dict[str, Any]], last: dict[str, Any]) -> bool:
    """Whether the session outlived its last epoch: it did not end with that one's reason.

    Of a stop by the guard the session also says limit, value and remedy, the epoch only the cause.
    """
    end = next((event for event in events if event.get("event") == "session_ended"), None)
    if end is None:
        return False
    by_guard = all(event["reason"].startswith(_BY_GUARD) for event in (end, last))
    return not by_guard and end["reason"] != last["reason"]
