"""The methods of a study as paragraphs for a paper, made from the facts of this study alone.

The words are in ``methods.txt``, a template. What the recordings and settings do not say is left
out: controller, perturbation and limits where an epoch was not recorded by this program's own loop,
and tests that were not made.
"""

from __future__ import annotations

import functools
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from importlib import resources
from typing import Any

import jinja2
import numpy as np

from rigidimeter.analysis.estimation import METHODS, Method
from rigidimeter.analysis.report.references import Cited, Prose
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.study import RATING, Compared, Condition, StudyResult, result_table
from rigidimeter.core.records import Epoch, Fit
from rigidimeter.core.version import __version__
from rigidimeter.core.words import condition_name, decimals, fixed, number, plural, series

_WORDS = ("No", "One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten")

OFFSETS = {"condition in day": "condition within a day", "subject/day": "day within a subject"}
"""How sentences call what has an offset of its own in a mixed model, where not by its name."""

_STIMULATION = {
    "title": "{title}",
    "frequency_hz": "{frequency_hz:g} Hz",
    "amplitude": "{amplitude:g} {amplitude_unit}",
    "pulse_width_us": "pulse width {pulse_width_us:g} µs",
    "electrodes": "electrodes {electrodes}",
    "wash_in_min": "wash-in {wash_in_min:g} min",
}
_BY = {
    "protocol": "that did not end with success",
    "check": "rejected by a check",
    "estimate": "without a valid estimate",
    "operator": "excluded by the operator",
}


def methods_prose(shown: Shown) -> Prose:
    """Return the paragraphs of methods with their references."""
    cite = Cited()
    about = {"study": shown.study, "result": shown.result, "epochs": shown.epochs}
    text = _template().render(_facts(shown), shown=shown, cite=cite, **about)
    paragraphs = (re.sub(r" *\n *", " ", each).strip() for each in re.split(r"\n{2,}", text))
    return Prose(tuple(each for each in paragraphs if each), tuple(cite.found.values()))


@functools.cache
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        autoescape=False,  # plain text, which the page escapes
        undefined=jinja2.StrictUndefined,
        finalize=lambda value: value.replace("\n", " ") if isinstance(value, str) else value,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.globals |= {
        "commanded": commanded,
        "counted": lambda n, noun: plural(n, noun).replace(str(n), _word(n), 1),
        "g": lambda value, digits=6: f"{value:.{digits}g}",
        "name": condition_name,
        "number": number,
        "own": _own,
        "plural": plural,
        "version": __version__,
        "were": lambda n: "was" if n == 1 else "were",
    }
    place = resources.files("rigidimeter.analysis.report") / "methods.txt"
    return environment.from_string(place.read_text(encoding="utf-8"))


def _word(count: int) -> str:
    return _WORDS[count] if count < len(_WORDS) else str(count)


def _facts(shown: Shown) -> dict[str, Any]:
    """Return what the template names, besides the study, its result and its epochs."""
    result, study, analysis = shown.result, shown.study, shown.analysis
    settings, ratings = study.settings, study.ratings
    scored = {(score.source, score.epoch) for score in analysis.scores}
    days = {(s.subject, s.day) for s in study.sessions}
    by_days = _by_days(result)
    tested = [one for one in by_days if one.tested]
    out = {(e.source, e.epoch): e.by for e in study.exclusions}
    counts = Counter[str](out.values())
    held = ""
    if result.several_subjects:
        held = "of the same subject in all conditions"
    elif math.isfinite(analysis.inertia_kg_m2):
        held = f"of all conditions ({number(analysis.inertia_kg_m2)} kg·m²)"
    fit = None if ratings is None else ratings.fit
    estimated = [name for name in fit.offsets if name not in fit.inseparable] if fit else []
    # That of the ratings is told with their model.
    day_tests = [one.test for one in by_days if one.test and one.measure != RATING]
    return {
        **{name: getattr(settings, name) for name in ("controller", "guard", "prbs", "scores")},
        "sinusoid": settings.sinusoid,
        "analysis": analysis,
        "subjects": len({s.subject for s in study.sessions}),
        "days": len(days),
        "split": _split(result),
        "perturbed": [e for e in shown.epochs if (e.source, e.label) not in scored],
        "imposed": [e for e in shown.epochs if (e.source, e.label) in scored],
        "conditions": [text for c in study.conditions if (text := _stimulation(c))],
        "rates": ", ".join(_rates(shown)),
        "method": method_of(analysis.method),
        "band": _band(analysis.fits),
        "corrected": sum(delay.corrected for delay in analysis.delays),
        "held": held,
        "cycles": sorted({s.n_cycles for s in analysis.scores if s.outcome.included}),
        "excluded": out,
        "excluded_by": [f"{counts[by]} {text}" for by, text in _BY.items() if counts[by]],
        "ratings": ratings,
        "examiners": 0 if ratings is None else ratings.rows["rater"].nunique(),
        "offsets": series([f"each {OFFSETS.get(name, name)}" for name in estimated]),
        "by_epochs": any(one.tested for one in result.values if one.other == study.other),
        "by_days": tested,
        "primary": _primary(tested),
        "day_tests": day_tests,
        "all_paired": all(words.startswith("paired") for words in day_tests),
        "day_medians": any(getattr(one.statistic, "p_days", math.nan) > 0 for one in tested),
        "effects": [one.method for one in result.effects.values()],
        "other_methods": [
            f"{name}, {method_of(name).title}"
            for name in dict.fromkeys(one.method for one in result.methods)
        ],
        "both_inertias": len({one.inertia for one in result.methods}) > 1,
        "libraries": shown.provenance.get("libraries", ""),
    }


def _split(result: StudyResult) -> str:
    """Return in brackets how many days each condition has, where there are several."""
    rows = result_table(result, "conditions")
    each = [
        f"{plural(row['days'], 'day')} in {condition_name(row['name'])}"
        for row in rows
        if row["days"]
    ]
    sessions = result.study.sessions
    both = len({s[:3] for s in sessions}) - len({s[:2] for s in sessions})
    if len(each) > 1 and both > 0:
        each.append(f"{both} of them in more than one condition")
    return f" ({', '.join(each)})" if len(each) > 1 else ""


def _stimulation(c: Condition) -> str:
    about = vars(c)
    parts = [
        text.format(**about).rstrip()
        for name, text in _STIMULATION.items()
        if about[name] not in ("", None)
    ]
    return f"{condition_name(c.name)}, {', '.join(parts)}" if parts else ""


def _own(epochs: Sequence[Epoch]) -> bool:
    """Return whether this program's loop recorded them, so that its settings say how."""
    return bool(epochs) and all(e.excitation_hz is not None or e.motion is not None for e in epochs)


def _rates(shown: Shown) -> Iterator[str]:
    names = {"torque_nm": "torque", "angle_rad": "angle", "velocity_rad_s": "velocity"}
    rates: dict[str, list[str]] = {}
    facts = [channel for channels in shown.channels for channel in channels]
    for key, name in names.items():
        found = [c.mean_rate_hz for c in facts if c.name == key and math.isfinite(c.mean_rate_hz)]
        if found:
            rates.setdefault(number(float(np.median(found)), 3), []).append(name)
    return (f"{series(group)} at {rate} samples/s" for rate, group in rates.items())


def commanded(shown: Shown) -> str:
    """Return the lowest and the highest commanded torque of the included epochs, as recorded.

    Both as a range where epochs differ; nothing where no included epoch has its perturbation.
    """
    out = {(one.source, one.epoch) for one in shown.study.exclusions}
    reached_nm = [
        (facts.lowest, facts.highest)
        for epoch, each in zip(shown.epochs, shown.channels, strict=True)
        for facts in each
        if facts.name == "perturbation_nm" and facts.lowest < facts.highest
        if (epoch.source, epoch.label) not in out
    ]
    if not reached_nm:
        return ""
    places = decimals(math.nan, max(abs(nm) for ends in reached_nm for nm in ends)) + 1

    def ends(values_nm: Sequence[float]) -> str:
        extremes = (min(values_nm), max(values_nm))
        return " to ".join(dict.fromkeys(fixed(nm, places, sign=True) for nm in extremes))

    return " and ".join(map(ends, zip(*reached_nm, strict=True)))


def _band(fits: Iterable[Fit]) -> tuple[float, float] | None:
    """Return the band of all fits, None where it differs."""
    bands = {fit.band_hz for fit in fits if all(map(math.isfinite, fit.band_hz))}
    return bands.pop() if len(bands) == 1 else None


def _by_days(result: StudyResult) -> list[Compared]:
    """Return the tests of the main pair by days, in the order of the measures."""
    main = [one for one in result.comparisons if one.other == result.study.other]
    order = [one.measure for one in result.values]
    return sorted((one for one in main if one.by == "days"), key=lambda o: order.index(o.measure))


def _primary(tests: Sequence[Compared]) -> str:
    """Return the primary measures, where others were compared beside them; else empty."""
    primary = [one for one in tests if one.role == "primary"]
    if primary and primary[0].family.rule == "sequence":
        primary.sort(key=lambda one: one.family.order.index(one.measure.name))
    return series([one.measure.short for one in primary]) if len(primary) < len(tests) else ""


def method_of(name: str) -> Method:
    """Return the estimator of that name; of one that is not known here no more than its name."""
    found = (method for method in METHODS if method.name == name)
    unknown = Method(
        name,
        title=name,
        needs=("perturbation_nm",),
        methods_text=f"by the method “{name}”",
        fit=METHODS[0].fit,
        intervals_text="",
        pooled_text="",
    )
    return next(found, unknown)
