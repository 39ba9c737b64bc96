"""Rig checks and epoch quality: messages, delays, exclusions, one epoch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any

from markupsafe import Markup

from rigidimeter.analysis.figures import (
    CHANNELS,
    WINDOW_S,
    draw_recorded,
    drawn,
    origin_s,
    recorded_size,
    shown_channels,
)
from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    deviations_in_words,
    from_result,
    from_study_folder,
    named,
    paragraph,
    part,
)
from rigidimeter.analysis.report.methods import method_of
from rigidimeter.analysis.report.sections.every_epoch import HOW, WHO
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.study import result_table
from rigidimeter.analysis.traces import analysed_epoch, representative_fits
from rigidimeter.core.records import Delay, Fit, Score
from rigidimeter.core.words import SESSION, Column, Table, condition_name, plural, series

BY = ("protocol", "check", "estimate", "operator")


def _notices(shown: Shown) -> Iterator[Block]:
    yield Table(
        "notices",
        "Messages while reading and analysing",
        (Column("level", "Level", "outcome"), Column("text", "Message", "reason")),
        [{"level": notice.level, "text": notice.text} for notice in shown.result.notices],
        empty="None.",
    )


def _estimation(shown: Shown) -> Iterator[Block]:
    analysis = shown.analysis
    chosen = (
        f"Chosen automatically: {analysis.method_reason}."
        if analysis.method_reason
        else "It was requested by name."
    )
    yield paragraph(
        Markup("Method: <strong>{}</strong> ({}). {}").format(
            analysis.method, method_of(analysis.method).title, chosen
        )
    )
    yield Table(
        "delays",
        "Delay of the torque relative to the motion",
        (
            WHO[0],
            Column("delay_s", "Torque delay ± SE (ms)", page_factor=1e3, error="delay_s_se"),
            Column("corrected", "Corrected", "label"),
            Column("done", "What was done", "reason"),
        ),
        [
            {name: getattr(d, name) for name in ("source", "delay_s", "delay_s_se", "corrected")}
            | {"done": _done(d)}
            for d in analysis.delays
        ],
        note="A delay is positive where the time stamps of the torque are later than the motion "
        "that they belong to. SE is its standard error.",
        empty="The delay between torque and motion was not estimated.",
        folding=len(analysis.delays) > 1,
    )


def _done(delay: Delay) -> str:
    if not delay.corrected:
        return delay.remark
    way = "earlier" if delay.delay_s > 0 else "later"
    moved = f"the torque was moved {way} by this delay before anything was fitted or scored"
    return f"{moved}; {delay.remark}" if delay.remark else moved


def _exclusions(shown: Shown) -> Iterator[Block]:
    """Yield whatever is excluded or failed, once for each reason; of a study as a file only."""
    columns = (*WHO, Column("stage", "Stage", "text"), *HOW)
    yield Table(
        "exclusions",
        "Excluded epochs by stage of the analysis",
        () if from_study_folder(shown) else columns,
        _by_stage(shown),
        empty="" if from_study_folder(shown) else "No epoch was excluded.",
        folding=True,
    )


def _by_stage(shown: Shown) -> list[dict[str, Any]]:
    """Return what each stage excluded, and the epochs from which nothing was estimated."""
    analysis = shown.analysis
    stages: dict[str, Sequence[Fit | Score]] = {
        "fit": analysis.fits,
        "fit at fixed inertia": analysis.fixed_inertia,
        "score": analysis.scores,
    }
    analysed: set[tuple[str, ...]] = set()
    first: dict[tuple[tuple[str, ...], str, str], str] = {}
    for stage, results in stages.items():
        for one in results:
            who = (one.source, one.epoch, one.condition)
            analysed.add(who[:2])
            if not one.outcome.included:
                first.setdefault((who, one.outcome.kind, one.outcome.reason), stage)
    for epoch in shown.epochs:
        who = (epoch.source, epoch.label, epoch.condition)
        if who[:2] not in analysed:
            reason = epoch.closed.reason or "nothing was estimated from it"
            first[who, "failed", reason] = "none"
    keys = ("source", "epoch", "condition", "stage", "outcome", "reason")
    return [
        dict(zip(keys, (*who, stage, kind, reason), strict=True))
        for (who, kind, reason), stage in first.items()
    ]


def _study_exclusions(shown: Shown) -> Iterator[Block]:
    yield from_result(
        shown,
        "account",
        "All recorded epochs",
        Column("task", "Task", "check"),
        Column("condition", "Condition", "condition"),
        Column("recorded", "Recorded", "count"),
        Column("included", "Included", "count"),
        *(Column(f"by_{by}", f"Excluded by {by}", "count") for by in BY),
        Column("unlisted", "Not accounted for", "count"),
    )
    unlisted = sum(row["unlisted"] for row in result_table(shown.result, "account"))
    if unlisted:
        yield paragraph(
            Markup(
                "<strong>{} {} neither included nor listed as excluded</strong>; "
                "<code>tables/exclusions.csv</code> says what the analysis made of each."
            ).format(plural(unlisted, "recorded epoch"), "is" if unlisted == 1 else "are"),
            "banner",
        )
    named = any(e.who for e in shown.study.exclusions)
    yield from_result(
        shown,
        "excluded_epochs",
        "Excluded epochs: by whom and why",
        *SESSION,
        Column("source", "Session", "source"),
        Column("epoch", "Epoch", "label"),
        Column("task", "Task", "check"),
        Column("by", "Excluded by", "label"),
        *([Column("who", "Name", "label")] if named else []),
        Column("reason", "Reason", "reason"),
        empty="No epoch was excluded.",
        folding=True,
    )
    yield from_result(
        shown,
        "left_out",
        "Recordings left out completely",
        Column("path", "Path", "text"),
        *SESSION,
        Column("reason", "Reason", "reason"),
    )
    yield from _exclusions(shown)
    yield from _plan(shown)


def _plan(shown: Shown) -> Iterator[Block]:
    """Yield where the study was not carried out as planned."""
    if words := deviations_in_words(shown):
        yield paragraph(words)
    yield from_result(
        shown,
        "deviations",
        "Deviations from the plan",
        *SESSION,
        Column("order", "Number in the day", "count"),
        Column("kind", "Deviation", "label"),
        Column("detail", "Detail", "reason"),
        Column("path", "Session", "text"),
    )


def _recorded(shown: Shown) -> Iterator[Block]:
    for fit in representative_fits(shown.analysis, shown.condition_names):
        epoch = analysed_epoch(shown.as_analysed, fit)
        if epoch is None:
            continue
        channels = shown_channels(epoch)
        names = series([CHANNELS[name][0] for name in channels])
        names = names[:1].upper() + names[1:]
        which = f"{condition_name(fit.condition)}, {named(shown, fit)}"
        yield Figure(
            "recorded",
            f"{names} as recorded, not filtered; the first {WINDOW_S:g} s of {which}.",
            f"{names} over the first {WINDOW_S:g} s of {which}.",
            partial(
                drawn,
                recorded_size(len(channels)),
                draw_recorded,
                channels,
                origin_s(epoch),
                rows=len(channels),
                sharex=True,
            ),
        )
        return


def _provenance(shown: Shown) -> Iterator[Block]:
    yield Table(
        "provenance",
        "Software, settings and files",
        (Column("key", "What", "text"), Column("value", "Value", "reason")),
        [{"key": key, "value": value} for key, value in shown.provenance.items()],
        empty="Not recorded.",
    )


RIG = part(
    "Rig checks",
    Section("notices", "Notices", _notices),
    Section("estimation", "Estimation", _estimation),
    printed=2,
)
EPOCHS = part(
    "Epoch quality",
    Section("exclusions", "Exclusions", _study_exclusions, from_study_folder),
    Section("exclusions", "Exclusions", _exclusions, lambda shown: not from_study_folder(shown)),
    Section("recorded", "As recorded", _recorded),
    printed=1,
)
PROVENANCE = part("Provenance", Section("provenance", "Provenance", _provenance), printed=1)
