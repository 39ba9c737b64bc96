"""A design on a terminal: what is commanded, what to expect, and the days that it takes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from decimal import Decimal

from rigidimeter.cli.document_tables import document_tables
from rigidimeter.cli.terminal_tables import Block, Heading, Table
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.study_files import primary_words
from rigidimeter.core.units import deg_from_rad
from rigidimeter.core.words import number, scaled
from rigidimeter.model import Margins
from rigidimeter.planning import (
    Design,
    Detection,
    chip_count,
    count_words,
    design_document,
    prbs_toml,
)

_HEADS = ("J\n10⁻³ kg·m²", "B\nN·m·s/rad", "K\nN·m/rad")
_SCALES = (1e3, 1.0, 1.0)
"""To the units of `_HEADS`, as J is written everywhere."""


def design_blocks(design: Design, *, full: bool = False) -> Iterator[Block]:
    """Yield the first screen: the perturbation, the loop, the errors of an epoch, the days needed.

    With `full` every margin and error, and the tables of what is written as JSON.
    """
    yield _perturbation(design)
    yield _loop(design)
    if design.precision:
        yield ""
        yield from _precision(design)
    if design.detections:
        yield ""
        yield from _days_needed(design.detections)
    yield from _found_by_search(design)
    remarks = [f"{text}." for text in design.remarks]
    warnings = [f"Warning: {text}." for text in (*design.warnings, *design.stability.warnings)]
    yield from (*remarks, *warnings)
    if full:
        yield from _full_blocks(design)
    elif design.detections:
        yield "--full: everything · --out DIR: a folder of the plan · --json FILE: every number"
    else:
        yield ""
        yield "--detect damping=20%: the days, epochs and subjects it takes · --full: all"


def _days_needed(detections: Sequence[Detection]) -> Iterator[Block]:
    """Yield the table of days by epochs a day, and the scatter that it assumes."""
    first = detections[0]
    yield Heading(
        f"Days with both conditions that show a difference from {first.condition} with a chance "
        f"of {100 * first.power:.3g} %"
    )
    yield f"primary measures: {primary_words(first.primary)} (level {first.alpha:g})"
    heads = [f"{each.epochs[0]}" for each in first.needed]
    if first.planned is not None:
        heads.append("plan {}+{}".format(*first.planned.epochs))
    rows = []
    for found in detections:
        each = [*found.needed, *([] if found.planned is None else [found.planned])]
        rows.append((f"{_difference(found)}: days", *(count_words(one.days) for one in each)))
        if found.before or found.level != found.alpha:
            alone = (count_words(one.days_alone) for one in each)
            rows.append(("  days, as the only primary", *alone))
        rows.append(("  subjects, one day each", *(count_words(one.subjects) for one in each)))
    align = "<" + ">" * len(heads)
    yield Table(("epochs a day and condition", *heads), rows, align, 1)
    yield from _scatter(detections)


def _perturbation(design: Design) -> str:
    prbs = design.settings.prbs
    motion = ", ".join(
        f"{name} {deg_from_rad(found.angle_sd_rad):.1f}°"
        for name, found in design.precision.items()
    )
    return (
        f"PRBS     ±{prbs.amplitude_nm:g} N·m, {chip_count(prbs)} chips at {prbs.clock_hz:g} Hz, "
        f"{prbs.duration_s:g} s" + (f"; SD of the angle {motion}" if motion else "")
    )


def _loop(design: Design) -> str:
    unstable = [n for n, found in design.stability.conditions.items() if not found.stable]
    if unstable:
        return f"loop     UNSTABLE with {', '.join(unstable)}"
    return (
        f"loop     stable, margins {_smallest(design.stability.conditions)}; worst joint "
        f"{_smallest(design.stability.worst)}"
    )


def _smallest(found: Mapping[str, Margins]) -> str:
    gain_db = min(margins.gain_margin_db for margins in found.values())
    phase_deg = min(margins.phase_margin_deg for margins in found.values())
    gain = "any gain" if math.isinf(gain_db) else f"{gain_db:.3g} dB"
    return f"{gain} and {'any phase' if math.isinf(phase_deg) else f'{phase_deg:.3g}°'}"


def _precision(design: Design) -> Iterator[Block]:
    low, high = next(iter(design.precision.values())).iv_band_hz
    yield Heading(f"Predicted standard error of one epoch (iv, {low:.2g}–{high:.2g} Hz)")
    sizes = [found.values for found in design.precision.values()]
    scales = [
        scaled(max(values), parameter.unit)
        for values, parameter in zip(zip(*sizes, strict=True), PARAMETERS, strict=True)
    ]
    rows = []
    for name, found in design.precision.items():
        cells = []
        for value, error, (factor, _) in zip(found.values, found.iv.free, scales, strict=True):
            share = f" ± {100 * error / value:.2g} %" if value else ""
            cells.append(f"{number(factor * value, 3)}{share}")
        rows.append((name, *cells))
    heads = [f"{each.symbol}, {unit}" for each, (_, unit) in zip(PARAMETERS, scales, strict=True)]
    yield Table(("", *heads), rows, "<===", 1)


def _difference(found: Detection) -> str:
    percent = -100.0 * found.difference / found.value
    return f"{found.wanted.parameter} {percent:+.3g} %".replace("-", "−")


def _scatter(detections: Sequence[Detection]) -> Iterator[Block]:
    texts = {f"{found.wanted.parameter} {found.scatter}": None for found in detections}
    share = 100.0 * detections[0].scatter.between_subjects
    yield f"Assumed SD: {'; '.join(texts)}; between subjects {share:.0f} % of the difference"


def _found_by_search(design: Design) -> Iterator[Block]:
    """Yield the best sequence of the search and the multisine, a line each."""
    if design.ranked and design.present:
        best = design.ranked[0]
        yield (
            f"Best PRBS of {len(design.ranked)} ({design.criterion}): {best.prbs.register_bits} "
            f"bits at {best.prbs.clock_hz:.4g} Hz, ±{best.prbs.amplitude_nm:.3g} N·m: error "
            f"{best.cost_percent:.2g} %, now {design.present.cost_percent:.2g} %."
        )
    if design.multisine is not None:
        name, errors = next(iter(design.multisine.errors.items()))
        pairs = zip("JBK", errors["same_peak_torque"], errors["prbs"], strict=True)
        ratios = ", ".join(f"{symbol} {other / own:.2f}" for symbol, other, own in pairs if own)
        yield (
            f"Multisine of the same peak torque: standard errors {ratios} times those of the PRBS "
            f"({name})."
        )


def _full_blocks(design: Design) -> Iterator[Block]:
    yield ""
    yield from _all_errors(design)
    yield ""
    document = design_document(design)
    for on_screen in ("schema", "precision", "detection", "warnings", "remarks"):
        del document[on_screen]
    del document["protocol"]["epochs"]  # which `--out` writes
    yield from document_tables(document)
    if design.ranked:
        yield "The best PRBS, as settings:"
        yield from (f"    {line}" for line in prbs_toml(design.ranked[0].prbs).splitlines())
    if not design.warnings:
        yield "Everything stays within the guard's limits."


def _all_errors(design: Design) -> Iterator[Block]:
    """Yield the standard errors of one epoch, and of all planned ones."""
    counts = design.planned_epochs
    yield Heading("Predicted standard errors of one epoch")
    for name, found in design.precision.items():
        errors = [
            ("bound, every frequency", found.bound.free),
            (f"iv, {_band(found.iv_band_hz)}", found.iv.free),
            (
                f"least squares, passive arm, {_band(found.least_squares_band_hz)}",
                found.least_squares.free,
            ),
        ]
        if counts[name] > 1:
            errors.insert(2, (f"iv, {counts[name]} epochs pooled", found.iv_pooled(counts[name])))
        rows = [(what, *map(_error, values, found.values, _SCALES)) for what, values in errors]
        yield Table((f"subject {name}", *_HEADS), rows, "<>>>")
        if any(found.least_squares_bias):
            off = ", ".join(
                f"{symbol} by {100.0 * bias / value:+.0f} %"
                for symbol, bias, value in zip(
                    "JBK", found.least_squares_bias, found.values, strict=True
                )
                if value
            )
            yield f"  the subject's own torque would bias least squares without weights: {off}"


def _band(band_hz: tuple[float, float]) -> str:
    low, high = band_hz
    return f"{low:.2g}–{high:.2g} Hz"


def _error(error: float, value: float, scale: float) -> str:
    share = f" ({100.0 * error / value:.2g} %)" if value else ""
    return _plain(scale * error) + share


def _plain(value: float, digits: int = 2) -> str:
    """Return a number of so many digits without an exponent.

    Examples
    --------
    >>> _plain(0.00009163), _plain(0.01234, 3)
    ('0.000092', '0.0123')
    """
    return f"{Decimal(f'{value:.{digits}g}'):f}"
