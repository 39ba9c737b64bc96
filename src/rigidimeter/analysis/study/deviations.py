"""Where a study was not carried out as it was planned, and whether its results depend on that.

The plan is that of the study folder, what was recorded is in the manifests of its sessions. No
conclusion changes by itself: what deviates is listed, and each primary measure is tested once more
without the sessions that deviate.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from rigidimeter.analysis.study.measures import RATING
from rigidimeter.analysis.study.results import Deviation, SessionEntry, StudyResult
from rigidimeter.analysis.study.tested import basis_of, tested, tested_again
from rigidimeter.core.errors import UserError
from rigidimeter.core.session import session_settings
from rigidimeter.core.settings import dump_settings, load_settings
from rigidimeter.core.study_files import (
    PlannedBlock,
    RecordedBlock,
    StudyPlan,
    read_plan,
    recorded_blocks,
)
from rigidimeter.core.words import fixed, plural, series

TOLERANCE_MIN = 0.5
"""By which a wait may be shorter than planned."""

KINDS = {
    "not done": "not recorded",
    "not planned": "not planned",
    "out of order": "out of order",
    "short wait": "begun too early",
    "unknown wait": "begun after an unknown wait",
    "other protocol": "with another protocol",
    "cut short": "with epochs missing",
    "plan edited": "before the plan was changed",
}
"""What a deviation is called in a sentence on several."""

_SECTIONS = ("prbs", "sinusoid", "protocol", "controller", "guard")
"""Of the settings: what a protocol file decides, and not the rig or the seed."""


def deviations(folder: Path, sessions: Sequence[SessionEntry]) -> tuple[Deviation, ...]:
    """Return every deviation of a study from its plan; none where it has no plan.

    Parameters
    ----------
    folder : Path
        Of the study.
    sessions : sequence of SessionEntry
        Those that were analysed.

    Raises
    ------
    UserError
        If the plan or a manifest cannot be read.
    """
    plan = read_plan(folder)
    if plan is None:
        return ()
    recorded = [one for one in recorded_blocks(folder) if one.begun]
    listed = {entry.path: entry for entry in sessions}
    found = list(_of_plan(plan, recorded))
    for one in recorded:
        if one.path in listed:
            found += _of_session(plan, one, listed[one.path])
    recorded_paths = {one.path for one in recorded}
    for path, entry in listed.items():
        if path not in recorded_paths:
            found.append(_unplanned(entry))
    return tuple(found)


def _of_plan(plan: StudyPlan, recorded: Sequence[RecordedBlock]) -> Iterator[Deviation]:
    """Yield what was planned and not done, and what was done in another order than planned."""
    first = {one.key: k for k, one in reversed(list(enumerate(recorded)))}
    for subject in plan.about.subjects:
        own = [block for block in plan.blocks if block.subject == subject]
        latest = -1
        for block in own:
            at = first.get(block.key)
            if at is None:
                yield _planned(plan, block, "", "not done", "was planned and is not recorded")
                continue
            if at < latest:
                detail = "was recorded before a session that is planned before it"
                yield _planned(plan, block, recorded[at].path, "out of order", detail)
            latest = max(latest, at)


def _of_session(plan: StudyPlan, one: RecordedBlock, entry: SessionEntry) -> Iterator[Deviation]:
    """Yield in what a recorded session differs from its place in the plan."""
    block = next((block for block in plan.blocks if block.key == one.key), None)
    if block is None:
        yield _unplanned(entry)
        return
    since, reason = one.facts["since_change_min"], one.facts["wait_cut_short"]
    if one.facts["sha256"] != plan.sha256:
        detail = "plan.csv was changed after this session"
        yield _planned(plan, block, one.path, "plan edited", detail)
    because = f" ({reason})" if reason else ""
    if since is None and block.wait_min > 0.0:
        detail = f"{block.wait_min:g} min of wait were planned; when it began is unknown{because}"
        yield _planned(plan, block, one.path, "unknown wait", detail)
    elif since is not None and since < block.wait_min - TOLERANCE_MIN:
        detail = f"begun {since:.3g} min after the change; {block.wait_min:g} planned"
        yield _planned(plan, block, one.path, "short wait", detail + because)
    if one.good < one.planned:
        detail = f"{one.good} of {plural(one.planned, 'epoch')} ended with success"
        yield _planned(plan, block, one.path, "cut short", detail)
    if changed := _changed_settings(plan, block, plan.folder / one.path):
        detail = f"recorded with another {series(changed)} than {block.protocol} has now"
        yield _planned(plan, block, one.path, "other protocol", detail)


def _changed_settings(plan: StudyPlan, block: PlannedBlock, session: Path) -> list[str]:
    try:
        planned = dump_settings(load_settings(plan.folder / block.protocol))
    except UserError:
        return ["protocol, for its file cannot be read,"]
    run = dump_settings(session_settings(session))
    return [name for name in _SECTIONS if planned[name] != run[name]]


def _planned(plan: StudyPlan, block: PlannedBlock, path: str, kind: str, detail: str) -> Deviation:
    condition = plan.shown(block.condition)
    return Deviation(block.subject, block.day, block.order, condition, path, kind, detail)


def _unplanned(entry: SessionEntry) -> Deviation:
    return Deviation(
        entry.subject,
        entry.day,
        0,
        entry.code,
        entry.path,
        "not planned",
        "was recorded and was not planned",
    )


def deviation_words(result: StudyResult) -> str:
    """Return one sentence on all deviations and on what depends on them; empty without any."""
    if not result.deviations:
        return ""
    kinds: dict[str, int] = {}
    for one in result.deviations:
        kinds[one.kind] = kinds.get(one.kind, 0) + 1
    counted = series([f"{count} {KINDS[kind]}" for kind, count in kinds.items()])
    again = without_deviating(result)
    depends = ""
    if again:
        words = series([row["words"] for row in again])
        depends = f" Without the sessions that deviate: {words} (p unadjusted)."
    return f"Sessions not as planned: {counted}.{depends}"


def without_deviating(result: StudyResult) -> list[dict[str, Any]]:
    """Return the test of each primary measure once more, without the sessions that deviate.

    One row for each measure that can still be tested; p is that of this test alone.
    """
    paths = {one.path for one in result.deviations if one.path}
    sources = {entry.source for entry in result.sessions if entry.path in paths}
    compared = [
        c
        for c in result.comparisons
        if c.paired and c.measure is not RATING and result.primary.role(c.measure) == "primary"
    ]
    if not sources or not compared:
        return []
    rows = []
    for c in compared:
        left = [one for one in c.observations if one.source not in sources]
        if len({one.condition for one in left} & {*c.pair}) < len(c.pair):
            continue
        basis = basis_of(compared)
        before, again = tested(c, basis), tested_again(c, left, basis)
        if math.isnan(again.p):
            continue
        percent = again.difference.percent[0]
        size = f"{fixed(percent, 0, sign=True)} %"
        words = f"{c.measure.short} {size}, {again.said}, with them {before.said}"
        rows.append(
            {
                "measure": c.measure.name,
                "difference_percent": percent,
                "p": again.p,
                "p_with_all": before.p,
                "words": words,
            }
        )
    return rows
