"""How a file should be read: what its numbers decide, and what only a person can say.

The search takes the questions of a verdict in turn. The numbers decide a unit where every other
usual one is impossible, the torque among several columns where one alone belongs to the motion, and
its sign; each with its reason. The unit of a torque, a lever arm and a calibration they never
decide, nor whether 0, 1, 2 are milliseconds or sample numbers, and 0, 5, 10 milliseconds or ticks
of another clock: each has a rate and a joint that are possible.
"""

from __future__ import annotations

import itertools
import re
from dataclasses import dataclass

import numpy as np

from rigidimeter.analysis.reading_anew.clock import may_be_ticks, restarts
from rigidimeter.analysis.reading_anew.columns import Array, Columns
from rigidimeter.analysis.reading_anew.gate import BELIEVED_SPEED_RAD_S, broken
from rigidimeter.analysis.reading_anew.headers import SCALED, read_header
from rigidimeter.analysis.reading_anew.judge import Verdict, seen_as, usual_units, verdict
from rigidimeter.analysis.reading_anew.labels import label_columns
from rigidimeter.analysis.reading_anew.mapping import Fault, Mapping
from rigidimeter.analysis.reading_anew.quantities import MOTION, names_epochs

MOST_STEPS = 8
MOST_PAIRS = 36
# Of the share of a torque that the motion explains, the best and the second best.
_BELONGS, _DOES_NOT = 0.8, 0.5


@dataclass(frozen=True)
class Proposal:
    """What to say of a file so that it is read.

    Parameters
    ----------
    mapping : Mapping
    reasons : tuple of str
        Why, for what was added to what the user said.
    verdict : Verdict
        What is known of the file then; its faults are what only a person can know.
    """

    mapping: Mapping
    reasons: tuple[str, ...]
    verdict: Verdict


Step = tuple[Mapping, str]
"""A mapping that answers a question, and why."""


def propose(file: Columns, said: Mapping) -> Proposal:
    """Return how a file should be read, with what the user says already."""
    read: dict[str, Array] = {}
    reasons: list[str] = []
    for _ in range(MOST_STEPS):
        now = verdict(file, said, read)
        step = _next(file, now, read)
        if step is None:
            break
        said, why = step
        reasons += [why] if why else []
    return Proposal(said, tuple(reasons), verdict(file, said, read))


def _next(file: Columns, now: Verdict, read: dict[str, Array]) -> Step | None:
    """Return the answer to the first question that the numbers or the file answer."""
    several = {fault.quantity: fault for fault in now.faults if fault.rule == "several"}
    several |= {f.quantity: f for f in now.warnings if f.rule == "several" and f.quantity in MOTION}
    if several:
        step = _pair(file, several, read) or _one(file, several, read)
        if step is not None:
            return step
    for fault in now.faults:
        if fault.rule == "stated lever arm":
            return fault.remedies[0], "the file states the lever arm of the force"
    return _trials(file, now) or _units(file, now) or _sign(now)


def _explained(file: Columns, said: Mapping, read: dict[str, Array]) -> float:
    """Return the share of the torque that the motion explains, 0 where that is not known."""
    seen = verdict(file, said, read).seen
    return 0.0 if seen is None or seen.fit is None else seen.fit.r_squared


def _pair(file: Columns, several: dict[str, Fault], read: dict[str, Array]) -> Step | None:
    """Choose the torque and the motion that alone belong together, of several of each."""
    motions = [name for name in MOTION if name in several]
    if "torque" not in several or len(motions) != 1:
        return None
    (motion,) = motions
    torques, moved = several["torque"].remedies, several[motion].remedies
    if len(torques) * len(moved) > MOST_PAIRS:
        return None
    pairs = [
        (one, one.saying(**{motion: {"column": other.pick(motion).column}}))
        for one, other in itertools.product(torques, moved)
    ]
    explained = {both: _explained(file, both, read) for _, both in pairs}
    ranked = sorted(explained, key=lambda both: -explained[both])
    best, second = ranked[0], ranked[1]
    if explained[best] < _BELONGS or explained[second] > _DOES_NOT:
        return None
    return best, (
        f"the share of the torque that the motion explains is {explained[best]:.2f} with "
        f"{best.torque.column!r} and {best.pick(motion).column!r}, and at most "
        f"{explained[second]:.2f} with any other two"
    )


def _one(file: Columns, several: dict[str, Fault], read: dict[str, Array]) -> Step | None:
    """Choose the torque, or the motion, that alone belongs to the other."""
    for name in (one for one in ("torque", "velocity", "angle") if one in several):
        explained = {one: _explained(file, one, read) for one in several[name].remedies}
        ranked = sorted((one for one in explained if explained[one]), key=lambda m: -explained[m])
        if len(ranked) < 2 or explained[ranked[0]] < _BELONGS or explained[ranked[1]] > _DOES_NOT:
            continue
        shown = ", ".join(f"{explained[m]:.2f} with {m.pick(name).column!r}" for m in ranked[:4])
        why = f"the share of the torque that the motion explains is {shown} as the {name}"
        return ranked[0], why
    return None


def _trials(file: Columns, now: Verdict) -> Step | None:
    """Take for the epochs the column of trials: by where the time starts anew, or by its name.

    Of several that are named so, the one that changes wherever another does: trials within blocks.
    """
    found, said = now.found, now.found.said
    if "epoch" in found.chosen.labels or "torque" not in found.raw or file.intervals:
        return None
    used = {*found.chosen.columns.values(), *found.chosen.labels.values()}
    n_rows = found.raw["torque"].size
    starts = restarts(found.raw["time"]) if "time" in found.raw else np.empty(0)
    name = reason = ""
    if starts.size and 2 * starts.size <= n_rows:
        for column, one in file.columns.items():
            if one.size == n_rows and not name:
                values = one.read()
                changed = np.flatnonzero(values[1:] != values[:-1]) + 1
                name = column if np.array_equal(changed, starts) else ""
        reason = f"the time starts anew where {name!r} changes"
    elif said.epoch_length_s is None:
        named = {
            frozenset(rows): [name for name in columns if names_epochs(name)]
            for rows, columns in label_columns(file, used, n_rows).items()
        }
        named = {rows: names for rows, names in named.items() if names}
        finest = max(named, key=len, default=frozenset())
        if all(rows <= finest for rows in named):
            name = named[finest][0] if named else ""
        reason = f"the rows of each label of {name!r} follow one another, as an epoch's do"
    return (said.saying(epoch_column=name), reason) if name else None


def _units(file: Columns, now: Verdict) -> Step | None:
    """Add the units that are the only possible ones, of time and motion."""
    found, chosen = now.found, now.found.chosen
    vary = [name for name in chosen.unstated if name in ("time", *MOTION)]
    if not vary and now.seen is not None:
        vary = [
            one.rule.quantity
            for one in broken(now.seen)
            if one.rule.quantity in chosen.columns and one.rule.quantity not in chosen.of_user
        ]
    vary = [
        name
        for name in vary
        if name in found.raw
        and name != "torque"  # which the numbers never decide
        and not _states_unknown(file, chosen.columns[name])
    ]
    if not vary or ("time" in vary and may_be_ticks(found.raw["time"])):
        return None
    usual = {name: usual_units(file, found, name) for name in vary}
    possible, speeds_rad_s = [], []
    for units in itertools.product(*usual.values()):
        as_units = dict(zip(vary, units, strict=True))
        seen = seen_as(file, found, as_units)
        if seen is not None and not broken(seen):
            possible.append(as_units)
            by_angle = not np.isnan(seen.speed_rad_s)
            speeds_rad_s.append(seen.speed_rad_s if by_angle else seen.velocity_rad_s)
    low, high = BELIEVED_SPEED_RAD_S
    if not all(low <= speed <= high for speed in speeds_rad_s):
        return None  # the unit may be none of the usual ones: ticks, mrad, tenths of a degree
    said, reasons = found.said, []
    for name in vary:
        left = {as_units[name] for as_units in possible}
        if len(left) == 1:
            (unit,) = left
            reasons.append(f"{name} can only be in {unit} (of {', '.join(usual[name])})")
            said = said.saying(**{name: {"unit": unit}})
    return (said, "; ".join(reasons)) if reasons else None


def _states_unknown(file: Columns, column: str) -> bool:
    """Whether a name states what is no unit, in brackets or as a factor, as in `0.1 deg`."""
    states = re.search(r"[\[(]", column) or SCALED.search(column)
    return bool(states) and not read_header(column, file.columns[column].unit).unit


def _sign(now: Verdict) -> Step | None:
    """Turn the sign of a torque with which J, B and K are negative."""
    seen, said = now.seen, now.found.said
    fit = None if seen is None or said.reaction else seen.fit
    if fit is None or not np.all(fit.signs < 0):
        return None
    return said.saying(reaction=True), "J, B and K are negative without --reaction"
