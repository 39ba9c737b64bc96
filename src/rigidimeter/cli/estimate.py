"""`rigidimeter estimate`: J, B, K and scores of recordings."""

from __future__ import annotations

from pathlib import Path

import typer

from rigidimeter.cli.help_pages import WRITE
from rigidimeter.cli.options import CSV, FULL, JSON
from rigidimeter.cli.output import keep_inputs
from rigidimeter.cli.reading_options import Recordings, reads_recordings
from rigidimeter.cli.terminal_tables import show


@reads_recordings
def estimate(
    recordings: Recordings,
    json_out: Path | None = JSON,
    csv_out: Path | None = CSV,
    subject_torque_out: Path | None = WRITE.option(
        "--subject-torque FILE",
        "Torque of the subject, .csv or .parquet. Measured, joint and subject's torque of each "
        "epoch.",
    ),
    full: bool = FULL,
) -> None:
    """Estimate inertia J, damping B and stiffness K of each epoch.

    Sinusoidal epochs have scores. A file holds time_s, torque_nm, at least one of velocity_rad_s
    and angle_rad, and optionally velocity_command_rad_s, perturbation_nm, epoch, condition and
    task. Torque is positive when it drives the joint toward positive angles. The exit status is 1
    if any input was bad, the others are still analysed, or if no epoch counts.

    \b
    For example:
      rigidimeter estimate demo-study/sessions/day-1-OFF
      rigidimeter estimate demo-study/elbow.csv --column epoch=trial
      rigidimeter estimate demo-study/elbow.csv --column epoch=trial \\
          --column "torque=torque [Nm]" --unit torque=Nm --json estimates.json
    """
    from rigidimeter.analysis.reading import write_estimates_csv, write_estimates_json
    from rigidimeter.analysis.recording import check_name, write_subject_torque
    from rigidimeter.cli.estimate_text import estimate_blocks
    from rigidimeter.cli.inputs import analyse_recordings

    keep_inputs((json_out, csv_out, subject_torque_out), recordings.paths)
    if subject_torque_out is not None:
        check_name(subject_torque_out)
    read, analysed = analyse_recordings(recordings)
    analysis = analysed.analysis
    try:
        if json_out is not None:
            write_estimates_json(json_out, analysis)
        if csv_out is not None:
            write_estimates_csv(csv_out, analysis)
        show(estimate_blocks(read, analysis, full=full))
        if subject_torque_out is not None:
            write_subject_torque(subject_torque_out, read, analysis)
    finally:
        status = analysed.say()
    raise typer.Exit(status)
