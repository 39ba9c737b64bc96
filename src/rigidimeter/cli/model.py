"""`rigidimeter model`: the torque as a sum of terms, and which terms it needs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import typer

from rigidimeter.cli.help_pages import ESTIMATE
from rigidimeter.cli.options import FULL, JSON
from rigidimeter.cli.output import echo, keep_inputs, say
from rigidimeter.cli.progress import Meter
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.cli.terminal_tables import show
from rigidimeter.core.errors import UserError


@reads_recordings
def model(
    recordings: Recordings,
    terms: list[str] | None = ESTIMATE.option(
        "--terms NAME,NAME,...",
        "Terms of the torque, by their names. Repeat to compare your own models.",
    ),
    compare: bool = ESTIMATE.flag(
        "--compare",
        "Compare models, and recommend one. Each model predicts blocks of an epoch that it has "
        "not seen. With one --terms, J, B and K alone are tried, with each further term, and "
        "more beside the best as long as they predict better.",
    ),
    json_out: Path | None = JSON,
    full: bool = FULL,
) -> None:
    """Fit the torque as a sum of terms, and find the terms it needs.

    Recordings are read as by `estimate`. A band from 0 Hz (--band-hz 0 40) keeps the mean of the
    torque, which offset and coulomb need. Each epoch passes the checks of `estimate` first. The
    exit status is 1 if any input was bad, or if no model is recommended for an epoch.

    \b
    For example:
      rigidimeter model demo-study/elbow.csv --terms inertia,reflex --compare
    """
    from rigidimeter.analysis.recording import fit_terms, model_document
    from rigidimeter.cli.model_text import model_blocks
    from rigidimeter.core.files import write_json

    if recordings.method not in ("auto", "bandlimited"):
        raise UserError(
            f"--method {recordings.method}: terms are fitted only with bandlimited; leave it out"
        )
    band_hz = recordings.band_hz
    if band_hz is not None and band_hz[0] == 0:
        if not band_hz[1] > 0:
            raise UserError(f"--band-hz 0 {band_hz[1]:g}: the upper edge must be above 0 Hz")
        # The settings refuse a band from 0 Hz, because the other methods need its lower edge.
        recordings = replace(recordings, band_hz=None)
        high_hz: float | None = band_hz[1]
    else:
        high_hz = None
    keep_inputs((json_out,), recordings.paths)
    read = recordings.read()
    say(read.notices)
    with Meter("model", 1.0, from_first=True) as meter:
        advance = meter.advance
        found = fit_terms(read, terms, compare=compare, high_hz=high_hz, progress=advance).epochs
    for each in found:
        for problem in filter(None, (each.problem, *(() if compare else each.unfitted))):
            echo(f"error: {each.epoch.name}: {problem}", err=True)
    if json_out is not None:
        write_json(json_out, model_document(found))
    show(model_blocks(found, full=full))
    raise typer.Exit(int(read.failed or any(each.failed for each in found)))
