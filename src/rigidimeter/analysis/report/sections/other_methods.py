"""Sensitivity: every method, with J fixed and with J free, and other bands."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial

import numpy as np

from rigidimeter.analysis.figures import (
    band_label,
    band_percent,
    by_measure,
    draw_bands,
    draw_methods,
    drawn,
    methods_in,
    shift,
)
from rigidimeter.analysis.recording import split_pooled
from rigidimeter.analysis.report.contents import (
    Block,
    Figure,
    Section,
    bullets,
    from_study_folder,
    paragraph,
    part,
)
from rigidimeter.analysis.report.shown import Shown
from rigidimeter.analysis.study import method_caveats, result_table
from rigidimeter.core.records import PARAMETERS
from rigidimeter.core.words import INTERVAL, TURNED, Column, Table, condition_name, interval, number

MOST_BESIDE = 3


def _methods(shown: Shown) -> Iterator[Block]:
    found = result_table(shown.result, "sensitivity")
    if not found:
        return
    reference, other = map(condition_name, shown.study.pair)
    words = []
    for row in found:
        of, (estimate, low, high) = row["title"], shift(row)
        words.append(
            f"{of}, {row['method']}, J {row['inertia']}: {number(estimate, 3)} "
            f"{interval(low, high, 3)} {row['unit']}"
        )
    across = min(len(by_measure(found)), MOST_BESIDE)
    rows = math.ceil(len(by_measure(found)) / across)
    size = 7.4, 0.5 + (1.0 + 0.26 * len(methods_in(found))) * rows
    drawing = found, f"Shift, {other} − {reference}"
    yield Figure(
        "sensitivity",
        "The Hodges–Lehmann shift with its interval by each method, in the unit above the "
        "panel. At the top, black: the method of this report. Open circles: J estimated in each "
        "epoch; filled squares: J held at its median, as in the second stage of the paper.",
        f"Shifts by method. {'; '.join(words)}.",
        partial(drawn, size, draw_methods, *drawing, rows=rows, columns=across, sharey=True),
        "tall",
    )
    titles = {row["measure"]: row["title"] for row in found}
    of_each = method_caveats(shown.result.methods).items()
    caveats = [f"{titles[name]}: {text}." for name, text in of_each if text]
    if caveats:
        yield bullets(caveats)
        yield paragraph(
            "A difference counts as shown if p of the test by days is below 0.05, not adjusted; "
            "where days could not be tested, if p over epochs is.",
            "remark",
        )
    columns = (
        Column("title", "Measure", "text", below="unit"),
        Column("method", "Method", "check"),
        Column("n_reference", f"n {reference}", "count"),
        Column("n_other", f"n {other}", "count"),
        Column("shift", f"Shift {INTERVAL}", ends=("shift_low", "shift_high"), page_factor=TURNED),
        Column("r", "r", page_factor=TURNED),
        Column("p", "p, epochs", "p"),
        Column("p_day", "p, days", "p"),
        Column("chosen", "Used here", "label"),
    )
    for inertia, title in (
        ("free", f"The shift by each method, {other} − {reference}"),
        (
            "fixed",
            f"The shift with J held at its median, {other} − {reference}: the paper’s second stage",
        ),
    ):
        of_stage = [row for row in found if row["inertia"] == inertia]
        yield Table("sensitivity", title, columns, of_stage)
    yield Table("sensitivity", "The shift by each method", (), found)


def _bands(shown: Shown) -> Iterator[Block]:
    found = shown.analysis.sensitivity
    of_conditions, _ = split_pooled(shown.analysis)
    half = {
        name: 50 * (fit.high - fit.low) / np.abs(fit.value) for name, fit in of_conditions.items()
    }
    words = "; ".join(
        f"{condition_name(one.condition)}, {band_label(one)}: "
        + ", ".join(
            f"{parameter.symbol} {number(change, 2)} ± {number(high - change, 2)} %"
            for parameter, (change, _, high) in zip(PARAMETERS, band_percent(one), strict=True)
        )
        for one in found
        if not one.of_fit
    )
    own = found[0]
    yield paragraph(
        "The estimates change with the band by no more than chance where the joint is inertia, "
        "damping and stiffness alone. Where they change by more, they carry a "
        "finding (band_sensitivity)."
    )
    conditions = {one.condition for one in found}
    bands = {band_label(one) for one in found if not one.of_fit}
    size = 7.4, 1.1 + (0.2 + 0.12 * len(conditions)) * len(bands)
    yield Figure(
        "band_sensitivity",
        f"Change of J, B and K of all epochs together from those of the band of the fit, "
        f"{own.low_hz:.3g} to {own.high_hz:.3g} Hz, if another band or one half of "
        "each epoch is used. Bars: 95 % interval of the change. Coloured bands: 95 % interval of "
        "the estimate.",
        f"How J, B and K depend on the band. {words}.",
        partial(drawn, size, draw_bands, found, half, columns=3, sharey=True),
        "tall",
    )
    yield Table(
        "band_sensitivity",
        "J, B and K of other bands and parts of the epochs",
        (),
        [one.row() for one in found],
    )


SECTIONS = part(
    "Sensitivity",
    Section("sensitivity", "Other methods", _methods, from_study_folder),
    Section(
        "band_sensitivity", "Other bands", _bands, lambda shown: bool(shown.analysis.sensitivity)
    ),
    printed=1,
)
