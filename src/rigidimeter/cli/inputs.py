"""Read what the user named, and go on with the rest when one input is bad."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, cast

import typer

from rigidimeter.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.recording import Recording
    from rigidimeter.records import Analysis, Fit, Notice, Score, Task
    from rigidimeter.settings import Settings

__all__ = [
    "Recordings",
    "adjusted",
    "analyse_inputs",
    "keep_inputs",
    "say",
    "status",
]


@dataclass(frozen=True)
class Recordings:
    """What the user named, and how to read it; the fields are the options of the commands.

    The settings are those of the file given, else those that the first session folder was recorded
    with, else the defaults.
    """

    paths: list[Path]
    method: str = "auto"
    column: list[str] | None = None
    rate_hz: float | None = None
    reaction: bool = False
    epoch_length_s: float | None = None
    condition: list[str] | None = None
    task: str | None = None
    band_hz: tuple[float, float] | None = None
    controller: tuple[float, float] | None = None
    settings: Path | None = None

    def read(self) -> Recording:
        """Read every input, with the band and the controller of the options in its settings.

        Raises
        ------
        UserError
            If an option is wrong, or not one input can be read.
        """
        from rigidimeter.recording import read

        recording = read(
            self.paths,
            column=_columns(self.column or []),
            rate_hz=self.rate_hz,
            reaction=self.reaction,
            epoch_length_s=self.epoch_length_s,
            condition=self.condition,
            task=cast("Task | None", self.task),
            settings=self.settings,
        )
        return replace(recording, settings=adjusted(recording.settings, self))


def adjusted(settings: Settings, wanted: Recordings) -> Settings:
    """Return the settings with the band and the controller that options give.

    Raises
    ------
    UserError
        If one is out of its range.
    """
    if wanted.band_hz is not None:
        settings = _with_band(settings, wanted.band_hz)
    if wanted.controller is not None:
        settings = _with_controller(settings, wanted.controller)
    return settings


def analyse_inputs(recording: Recording, method: str) -> Analysis:
    """Fit and score with progress.

    Raises
    ------
    UserError
        If there is no such method.
    """
    from rigidimeter.cli.progress import Meter
    from rigidimeter.estimation import method_names
    from rigidimeter.study import estimate

    if method not in method_names():
        known = ", ".join(method_names())
        raise UserError(f"--method {method}: there is no such method; known: {known}")
    with Meter("estimate", 2 * len(recording.epochs)) as meter:
        return estimate(recording, method, progress=lambda _: meter.advance())


def keep_inputs(outputs: Iterable[Path | None], inputs: Iterable[Path]) -> None:
    """Refuse to write over what is read.

    Raises
    ------
    UserError
        If an output is an input, lies in a session folder, or is named twice.
    """
    kept = {path.resolve() for path in inputs}
    for output in outputs:
        if output is None:
            continue
        place = output.resolve()
        if output.is_dir():
            raise UserError(f"{output}: cannot be written (it is a folder)")
        if not place.parent.is_dir():
            raise UserError(f"{output}: cannot be written (there is no folder {output.parent})")
        if place in kept:
            raise UserError(f"{output}: is read or written already; name another file to write")
        if (place.parent / "manifest.json").exists():
            raise UserError(f"{output}: lies in a session folder, which is never written to again")
        kept.add(place)


def say(notices: tuple[Notice, ...]) -> None:
    """Print notices to the standard error, one sentence a line."""
    for notice in notices:
        typer.echo(f"{notice.level}: {notice.text}", err=True)


def status(recording: Recording, analysis: Analysis) -> int:
    """Say what failed or looks wrong; return 1 if an input was bad or an epoch failed, else 0."""
    from rigidimeter.study import doubts

    say(doubts(analysis))
    bad = recording.failed
    results: list[Fit | Score] = [*analysis.fits, *analysis.scores]
    for result in results:
        if result.outcome.kind == "failed":
            bad = True
            typer.echo(
                f"error: {result.source}, epoch {result.epoch}: {result.outcome.reason}", err=True
            )
    return int(bad)


def _with_band(settings: Settings, band_hz: tuple[float, float]) -> Settings:
    from rigidimeter.settings import dump_settings, parse_settings

    low, high = band_hz
    values = dump_settings(settings)
    values["estimation"] |= {
        "band_low_hz": low,
        "band_high_hz": high,
        "band_high_unknown_hz": high,
        "band_high_closed_loop_hz": high,
    }
    return parse_settings(values, source=f"--band-hz {low:g} {high:g}")


def _with_controller(settings: Settings, controller: tuple[float, float]) -> Settings:
    from rigidimeter.settings import dump_settings, parse_settings

    inertia, damping = controller
    values = dump_settings(settings)
    values["controller"] |= {"inertia_kg_m2": inertia, "damping_nm_s_rad": damping}
    return parse_settings(values, source=f"--controller {inertia:g} {damping:g}")


def _columns(pairs: list[str]) -> dict[str, str]:
    columns: dict[str, str] = {}
    for pair in pairs:
        name, equals, column = pair.partition("=")
        if not (name and equals and column):
            raise UserError(
                f"--column {pair}: write NAME=COLUMN, for example --column torque_nm=Fz"
            )
        if name in columns:
            raise UserError(f"--column {pair}: {name} was already given as {columns[name]}")
        columns[name] = column
    return columns
