"""What was done: what was measured, how, and with which perturbation."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import partial
from typing import Any

import numpy as np
from markupsafe import Markup
from pydantic import BaseModel

from rigidimeter.analysis.figures import (
    EXCITATION_HEIGHTS,
    EXCITATION_SIZE,
    draw_excitation,
    drawn,
    origin_s,
)
from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    from_result,
    from_study_folder,
    named,
    paragraph,
    part,
)
from rigidimeter.analysis.report.methods import methods_prose
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.traces import ChannelFacts, perturbed_epoch
from rigidimeter.core.settings import Settings
from rigidimeter.core.units import rad_from_deg
from rigidimeter.core.words import (
    SESSION,
    Column,
    Table,
    condition_name,
    number,
    plural,
)

_TASKS = {"prbs": "torque perturbation", "sinusoid": "imposed sinusoid", None: "not stated"}

_OF_THE_RIG = ("Controller", "PRBS", "Sinusoid", "Limits")
"""Settings that recordings of another rig were not made with."""


def longest_s(channels: Iterable[ChannelFacts]) -> float:
    """Return how long the longest channel of an epoch lasts; NaN without samples."""
    return max((c.span_s for c in channels if math.isfinite(c.span_s)), default=math.nan)


def _methods(shown: Shown) -> Iterator[Block]:
    prose = methods_prose(shown)
    yield paragraph(
        Markup(
            "Made from the recordings, settings and tests of this study; also in "
            "<code>methods.txt</code>. One click selects all of it."
        ),
        "remark",
    )
    lines = [paragraph(text) for text in prose.paragraphs]
    if prose.references:
        lines.append(paragraph("References"))
        lines += [Markup('<p class="reference">{}</p>').format(r) for r in prose.references]
    yield Markup('<div class="copy">\n{}\n</div>').format(Markup("\n").join(lines))


def _about(shown: Shown) -> Iterator[Block]:
    median = (
        "the median of the same subject"
        if shown.result.several_subjects
        else f"the median ({number(shown.analysis.inertia_kg_m2)} kg·m²)"
    )
    yield paragraph(
        Markup(
            "A robot moved a joint while torque and motion were recorded. Each epoch with a torque "
            "perturbation gives the joint’s inertia J, viscous damping B and stiffness K: the "
            'values with which <span class="formula">J θ″ + B θ′ + K θ = M</span> comes closest to '
            "the measured torque M. These are what this page shows and compares. B and K with J "
            "held at {} over all included epochs, as in the paper, are in a table of their own. "
            "Each epoch with an imposed sinusoid gives two scores per cycle: the angular impulse "
            "∑|M|Δt and the work, which is the area of the torque–angle loop."
        ).format(median)
    )
    yield paragraph(
        Markup(
            "Numbers on this page are rounded. The files in <code>tables/</code> have every digit; "
            "<code>figures/</code> has the drawings."
        )
    )


def _design(shown: Shown) -> Iterator[Block]:
    if sessions := shown.study.sessions:
        coded = any(s.code != s.condition for s in sessions)
        yield from_result(
            shown,
            "sessions",
            "Sessions, in the order of the study’s table",
            *SESSION,
            *([Column("code", "Code", "label")] if coded else []),
            Column("path", "Path", "text"),
            folding=True,
        )
    elif shown.epochs:
        items = Markup("\n").join(
            Markup('<li><span class="path">{}</span> ({})</li>').format(
                source, plural(count, "epoch")
            )
            for source, count in Counter(epoch.source for epoch in shown.epochs).items()
        )
        yield Markup('<p>Sources:</p>\n<ol class="sources">\n{}\n</ol>').format(items)
    yield Table(
        "counts",
        "Epochs by task and condition",
        (
            Column("task", "Task", "text"),
            Column("condition", "Condition", "condition"),
            Column("epochs", "Epochs", "count"),
            Column("virtual_epochs", "Of which virtual", "count"),
            Column("median_duration_s", "Median duration (s)"),
            Column("shortest_s", "Shortest (s)"),
            Column("longest_s", "Longest (s)"),
        ),
        list(_counts(shown)),
        empty="There are no epochs.",
    )
    yield Table(
        "ticks",
        "Late and missed ticks of the loop",
        (
            Column("source", "Source", "source"),
            Column("epoch", "Epoch", "label"),
            Column("ran", "Ticks", "count"),
            Column("late", "Late", "count"),
            Column("missed", "Missed", "count"),
            Column("missed_percent", "Missed (%)"),
            Column("limited", "Limited", "count"),
        ),
        [
            {"source": epoch.source, "epoch": epoch.label, **epoch.ticks._asdict()}
            | {"missed_percent": epoch.ticks.missed_percent}
            for epoch in shown.epochs
            if epoch.ticks is not None
        ],
        note="A tick that began more than half a tick after it was due was late; one that never "
        "ran was missed, and the drive held its command. At a limited one the guard changed it.",
        folding=True,
    )
    names = ("part", "quantity", "value", "unit")
    yield Table(
        "design",
        "Main settings",
        (
            Column("part", "Part", "text"),
            Column("quantity", "Quantity", "text"),
            Column("value", "Value", "setting"),
            Column("unit", "Unit", "text"),
        ),
        [
            dict(zip(names, row, strict=True))
            for row in _main_settings(shown.study.settings)
            if shown.own_rig or row[0] not in _OF_THE_RIG
        ],
        note=Markup('Every setting is in <a href="tables/settings.csv">tables/settings.csv</a>.'),
    )
    yield Table("settings", "Every setting", (), list(_flat("", shown.study.settings)))


def _counts(shown: Shown) -> Iterator[dict[str, Any]]:
    recorded = list(zip(shown.epochs, map(longest_s, shown.channels), strict=True))
    for task, title in _TASKS.items():
        for condition in shown.condition_names:
            group = [(e, s) for e, s in recorded if e.task == task and e.condition == condition]
            if not group:
                continue
            durations = [s for _, s in group if math.isfinite(s)] or [math.nan]
            yield {
                "task": title,
                "condition": condition,
                "epochs": len(group),
                "virtual_epochs": sum(epoch.virtual for epoch, _ in group),
                "median_duration_s": float(np.median(durations)),
                "shortest_s": min(durations),
                "longest_s": max(durations),
            }


def _main_settings(s: Settings) -> list[tuple[str, str, float, str]]:
    """Return the settings that define the measurement and the analysis."""
    prbs, guard, sinusoid = s.prbs, s.guard, s.sinusoid
    length = 2**prbs.register_bits - 1
    inertia, damping = s.controller.inertia_kg_m2, s.controller.damping_nm_s_rad
    degree = rad_from_deg(1.0)
    return [
        ("Controller", "virtual inertia J_c", inertia, "kg·m²/rad"),
        ("Controller", "the same per degree", inertia * degree, "kg·m²/deg"),
        ("Controller", "virtual damping B_c", damping, "N·m·s/rad"),
        ("Controller", "the same per degree", damping * degree, "N·m·s/deg"),
        ("Controller", "torque low-pass", s.controller.torque_cutoff_hz, "Hz"),
        ("PRBS", "amplitude, either way", prbs.amplitude_nm, "N·m"),
        ("PRBS", "duration", prbs.duration_s, "s"),
        ("PRBS", "clock", prbs.clock_hz, "Hz"),
        ("PRBS", f"length of the {prbs.register_bits}-bit sequence", length, "chips"),
        ("PRBS", "its period", length / prbs.clock_hz, "s"),
        ("PRBS", "intended lower band limit", prbs.wanted_low_hz, "Hz"),
        ("PRBS", "intended upper band limit", prbs.wanted_high_hz, "Hz"),
        ("Sinusoid", "amplitude, either way", sinusoid.amplitude_deg, "deg"),
        ("Sinusoid", "frequency", sinusoid.frequency_hz, "Hz"),
        ("Sinusoid", "motion", sinusoid.motion_s, "s"),
        ("Limits", "position, either way", guard.position_limit_deg, "deg"),
        ("Limits", "speed", guard.speed_limit_deg_s, "deg/s"),
        ("Limits", "acceleration", guard.acceleration_limit_deg_s2, "deg/s²"),
        ("Estimation", "lower band limit", s.estimation.band_low_hz, "Hz"),
        ("Estimation", "upper band limit", s.estimation.band_high_closed_loop_hz, "Hz"),
        ("Checks", "upper band limit, perturbation recorded", s.estimation.band_high_hz, "Hz"),
        (
            "Checks and models",
            "upper band limit, perturbation not recorded",
            s.estimation.band_high_unknown_hz,
            "Hz",
        ),
        ("Scores", "lower band limit", s.scores.band_low_hz, "Hz"),
        ("Scores", "upper band limit", s.scores.band_high_hz, "Hz"),
        ("Scores", "cycles", s.scores.cycles, "cycles"),
    ]


def _flat(prefix: str, value: object, unit: str = "") -> Iterator[dict[str, str]]:
    """Yield key, value and unit of whatever a model, a mapping or a list holds."""
    if isinstance(value, BaseModel):
        for name, field in type(value).model_fields.items():
            extra = field.json_schema_extra
            field_unit = str(extra.get("unit", "")) if isinstance(extra, dict) else ""
            yield from _flat(f"{prefix}.{name}".lstrip("."), getattr(value, name), field_unit)
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from _flat(f"{prefix}.{name}", item, unit)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _flat(f"{prefix}[{index}]", item, unit)
    else:
        text = repr(value) if isinstance(value, float) else str(value)
        yield {"key": prefix, "value": text, "unit": unit}


def _perturbation(shown: Shown) -> Iterator[Block]:
    names = shown.condition_names
    epoch = perturbed_epoch(shown.analysis, names, shown.as_analysed, shown.epochs)
    if epoch is None:
        return
    channel = epoch.channels["perturbation_nm"]
    prbs = shown.study.settings.prbs
    low, high = epoch.excitation_hz or (prbs.wanted_low_hz, prbs.wanted_high_hz)
    whose = f"of {named(shown, epoch)} ({condition_name(epoch.condition)})"
    size_nm = float(np.max(np.abs(channel.values)))
    drawn_of = channel, origin_s(epoch), (low, high)
    heights = EXCITATION_HEIGHTS
    yield Figure(
        "perturbation",
        f"The commanded torque perturbation {whose}, and its power spectral density "
        "(Hann-windowed periodogram of the complete perturbation), with the intended band of "
        f"{low:g} to {high:g} Hz.",
        f"Torque perturbation {whose}: it switches between levels up to {number(size_nm)} N·m "
        f"for {number(channel.time_s[-1] - channel.time_s[0])} s. Below, its power spectral "
        f"density, with the intended band, {low:g} to {high:g} Hz, marked.",
        partial(drawn, EXCITATION_SIZE, draw_excitation, *drawn_of, rows=3, height_ratios=heights),
    )


SECTIONS = part(
    "What was done",
    Section("methods", "Methods, for a paper", _methods, from_study_folder),
    Section("about", "What this is", _about),
    Section("design", "Study design", _design),
    Section("perturbation", "Perturbation", _perturbation),
    printed=4,
)
