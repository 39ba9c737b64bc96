"""The files of `rigidimeter design`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from rigidimeter.documents import csv_text, write_json, write_text
from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.experiment import Alternative, Candidate, Foresight, Overview

__all__ = ["snippet", "write_folder"]


def snippet(best: Candidate) -> str:
    """Return a sequence as settings."""
    prbs = best.prbs
    return (
        f"[prbs]\nregister_bits = {prbs.register_bits}\nclock_hz = {prbs.clock_hz!r}\n"
        f"amplitude_nm = {prbs.amplitude_nm!r}\n"
    )


def write_folder(
    folder: Path,
    planned: Overview,
    seen: Foresight,
    ranked: tuple[Candidate, ...] | None,
    alternative: Alternative | None,
    document: dict[str, Any],
) -> list[str]:
    """Write what will be commanded and what is foreseen; return the names of the files.

    Raises
    ------
    UserError
        If the folder cannot be made or a file cannot be written.
    """
    from rigidimeter.reporting.figures import svg_text
    from rigidimeter.reporting.figures.open_loop import bode

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"{folder}: cannot be made a folder ({error.strerror or error})") from None
    rate_hz = planned.settings.rig.tick_rate_hz
    motion = zip(planned.angle_rad.tolist(), planned.velocity_rad_s.tolist(), strict=True)
    epochs = document["protocol"]["epochs"]
    names = ["prbs.csv", "sinusoid.csv", "protocol.csv", "bode.svg"]
    _write_torque(folder / "prbs.csv", planned.perturbation_nm.tolist(), rate_hz)
    write_text(
        folder / "sinusoid.csv",
        csv_text(
            ("time_s", "angle_rad", "velocity_rad_s"),
            ((tick / rate_hz, *values) for tick, values in enumerate(motion)),
        ),
    )
    write_text(folder / "protocol.csv", csv_text(list(epochs[0]), epochs))
    found = seen.stability
    write_text(folder / "bode.svg", svg_text(bode(planned.settings, found.conditions, found.worst)))
    if alternative is not None:
        names.append("multisine.csv")
        _write_torque(folder / names[-1], alternative.torque_nm.tolist(), rate_hz)
    if ranked is not None:
        names.append("optimised.toml")
        write_text(folder / names[-1], snippet(ranked[0]))
    write_json(folder / "design.json", document)
    return [*names, "design.json"]


def _write_torque(path: Path, torque_nm: list[float], rate_hz: float) -> None:
    rows = ((tick / rate_hz, value) for tick, value in enumerate(torque_nm))
    write_text(path, csv_text(("time_s", "perturbation_nm"), rows))
