"""The folder of a design: what will be commanded, what is predicted, and the Bode diagram."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rigidimeter.analysis.report.open_loop import bode
from rigidimeter.analysis.report.style import svg_text
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import csv_text, write_json, write_text
from rigidimeter.planning import Design, design_document, prbs_toml


def write_design_folder(folder: Path, design: Design) -> list[str]:
    """Write what will be commanded and what is predicted; return the names of the files.

    Raises
    ------
    UserError
        If the folder cannot be made or a file cannot be written.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder}: cannot be made a folder ({error.strerror or error})") from None
    motion = (design.angle_rad.tolist(), design.velocity_rad_s.tolist())
    epochs = [vars(epoch) for epoch in design.protocol.epochs]
    texts = {
        "prbs.csv": _columns(design, ["perturbation_nm"], [design.perturbation_nm.tolist()]),
        "sinusoid.csv": _columns(design, ["angle_rad", "velocity_rad_s"], motion),
        "protocol.csv": csv_text(list(epochs[0]), epochs),
        "bode.svg": svg_text(
            bode(design.settings, design.stability.conditions, design.stability.worst)
        ),
    }
    if design.multisine is not None:
        torque = [design.multisine.torque_nm.tolist()]
        texts["multisine.csv"] = _columns(design, ["perturbation_nm"], torque)
    if design.ranked is not None:
        texts["optimised.toml"] = prbs_toml(design.ranked[0].prbs)
    for name, text in texts.items():
        write_text(folder / name, text)
    write_json(folder / "design.json", design_document(design))
    return [*texts, "design.json"]


def _columns(design: Design, names: list[str], columns: Sequence[list[float]]) -> str:
    rate_hz = design.settings.rig.tick_rate_hz
    times_s = [tick / rate_hz for tick in range(len(columns[0]))]
    return csv_text(["time_s", *names], zip(times_s, *columns, strict=True))
