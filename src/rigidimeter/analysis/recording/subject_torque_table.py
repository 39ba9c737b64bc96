"""The torque of the subject in each epoch, once J, B and K are known (Eq. 5).

    M_sub = J θ″ + B θ′ + K θ − M_meas

in N·m and positive toward positive angles, with the J, B and K of the epoch, of signals that passed
the band of its fit alike. Sensor noise, and torque that the model lacks, are in it too.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path

import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from rigidimeter.analysis.estimation import aligned, epoch_signals, longest_part
from rigidimeter.analysis.reading import Recording
from rigidimeter.core.errors import UserError, refused
from rigidimeter.core.files import as_written, in_place, write_dictionary_beside
from rigidimeter.core.records import Analysis

_WRITERS = {".csv": pyarrow.csv.CSVWriter, ".parquet": pyarrow.parquet.ParquetWriter}


def subject_torque(recording: Recording, analysis: Analysis) -> Iterator[pa.Table]:
    """Return a table for each epoch with an included fit.

    Yields
    ------
    pyarrow.Table
        A row a sample: ``source``, ``epoch``, ``condition``, ``time_s``, ``angle_rad``,
        ``velocity_rad_s``, ``torque_nm``, ``joint_torque_nm`` (J θ″ + B θ′ + K θ) and
        ``subject_torque_nm``, all in the band of the fit.
    """
    epochs = {(epoch.source, epoch.label): epoch for epoch in recording.epochs}
    for fit in analysis.fits:
        if not fit.outcome.included:
            continue
        epoch = aligned(longest_part(epochs[fit.source, fit.epoch]), analysis.delays)
        signals = epoch_signals(epoch, recording.settings, fit.method)
        joint = (
            fit.inertia_kg_m2 * signals.acceleration_rad_s2
            + fit.damping_nm_s_rad * signals.velocity_rad_s
            + fit.stiffness_nm_rad * signals.angle_rad
        )
        names = (fit.source, fit.epoch, fit.condition)
        yield pa.table(
            {
                **{
                    name: pa.array([as_written(value)] * joint.size)
                    for name, value in zip(("source", "epoch", "condition"), names, strict=True)
                },
                "time_s": signals.time_s,
                "angle_rad": signals.angle_rad,
                "velocity_rad_s": signals.velocity_rad_s,
                "torque_nm": signals.torque_nm,
                "joint_torque_nm": joint,
                "subject_torque_nm": joint - signals.torque_nm,
            }
        )


def check_name(path: Path) -> None:
    """Refuse a name that says no format.

    Raises
    ------
    UserError
        If it ends in neither ``.csv`` nor ``.parquet``.
    """
    if path.suffix.lower() not in _WRITERS:
        raise UserError(f"{path}: the name must end in .csv or .parquet")


def write_subject_torque(path: Path, recording: Recording, analysis: Analysis) -> None:
    """Write the tables of all epochs below each other, as CSV or Parquet.

    Raises
    ------
    UserError
        If the name says neither, no epoch was included, or the file cannot be written.
    """
    check_name(path)
    tables = subject_torque(recording, analysis)
    first = next(tables, None)
    if first is None:
        raise UserError(f"{path}: not written, since no epoch has an included estimate")
    write = _WRITERS[path.suffix.lower()]
    with (
        refused(path, "cannot be written"),
        in_place(path) as beside,
        write(beside, first.schema) as out,
    ):
        for table in itertools.chain([first], tables):
            out.write_table(table)
    if path.suffix.lower() == ".csv":
        write_dictionary_beside(path, "subject_torque", first.schema.names)
