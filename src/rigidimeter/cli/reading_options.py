"""The options that say how recordings are read and fitted, and what they make of a command."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast, get_type_hints

from rigidimeter.cli.help_pages import ESTIMATE, HOW_TO_READ, argument
from rigidimeter.cli.options import SETTINGS
from rigidimeter.cli.progress import Meter
from rigidimeter.core.errors import UserError

if TYPE_CHECKING:
    from rigidimeter.analysis.reading import Recording
    from rigidimeter.core.records import Task
    from rigidimeter.core.settings import Settings


@dataclass(frozen=True)
class Recordings:
    """What the user named, and how to read and fit it; the fields are options of the commands."""

    paths: list[Path] = argument("INPUT", "Sessions, tables and other recordings.")
    method: str = ESTIMATE.option("--method NAME", "iv, bandlimited, spectral, published.", "auto")
    column: list[str] | None = HOW_TO_READ.option(
        "--column NAME=COLUMN",
        "Column of a quantity, such as torque=Fz. Write torque_nm=Fz to say that it is in N·m. "
        "Repeat as needed.",
    )
    unit: list[str] | None = HOW_TO_READ.option(
        "--unit NAME=UNIT",
        "Unit of a column, such as angle=deg. Where the file does not state it; repeat as needed.",
    )
    scale: list[str] | None = HOW_TO_READ.further(
        "--scale NAME=FACTOR",
        'What a column is multiplied by, for example "torque=2.5 Nm/V", or "torque=0.25 m" for a '
        "force with a lever arm; repeat as needed.",
    )
    offset: list[str] | None = HOW_TO_READ.further(
        "--offset NAME=VALUE",
        'What a column reads at zero, for example "torque=0.1 V"; repeat as needed.',
    )
    skip_rows: int = HOW_TO_READ.further(
        "--skip-rows N", "Lines at the beginning of a text not to read.", 0, min=0
    )
    names: str | None = HOW_TO_READ.further(
        "--names A,B,...", "The names of the columns of a text that does not name them."
    )
    table: str | None = HOW_TO_READ.further(
        "--table NAME",
        "The sheet, or the variable of a MATLAB file, that is read, of a file with several.",
    )
    missing: str | None = HOW_TO_READ.further(
        "--missing A,B,...",
        "Numbers that stand for lost samples of torque and motion, such as 0,-999; none: no number "
        "does. Default: found, where one recurs alone and far from the samples beside it.",
    )
    mapping: Path | None = HOW_TO_READ.further(
        "--mapping FILE",
        "A mapping file, which says columns, units and the like for the files of one laboratory; "
        "`rigidimeter inspect` writes one.",
    )
    join: bool = HOW_TO_READ.flag(
        "--join",
        "The inputs are one recording, such as torque and motion in two files.",
        hidden=True,
    )
    clock_offset: str | None = HOW_TO_READ.further(
        "--clock-offset S|found",
        "With --join: seconds to add to the clocks of the second and later inputs; found: "
        "estimated from torque and motion.",
    )
    rate_hz: float | None = HOW_TO_READ.further(
        "--rate-hz HZ", "Sampling rate of a file without a time_s column."
    )
    reaction: bool = HOW_TO_READ.flag(
        "--reaction",
        "Torque is the joint's reaction, of opposite sign. The file holds the negative of the "
        "torque that drives the joint.",
    )
    epoch_length_s: float | None = HOW_TO_READ.option(
        "--epoch-length-s S", "Cut into epochs of this length. For a file without an epoch column."
    )
    condition: list[str] | None = HOW_TO_READ.option(
        "--condition NAME",
        "Condition of each input, in their order. For files without a condition column; once for "
        "all of them, or once for each.",
    )
    task: str | None = HOW_TO_READ.further(
        "--task prbs|sinusoid",
        "Fit J, B and K (prbs) or score (sinusoid). Default: found from the motion.",
    )
    leave_out: list[str] | None = HOW_TO_READ.further(
        '--leave-out "[NAME=]START:STOP REASON"',
        "Seconds on the recording's clock that no estimate uses, for example "
        '"12.3:14.0 cough"; NAME is a recording, where there are several. Repeat as needed.',
    )
    blinded: bool = HOW_TO_READ.flag(
        "--blinded",
        "Of sessions that were recorded blinded: codes for the conditions.",
        hidden=True,
    )
    band_hz: tuple[float, float] | None = ESTIMATE.further(
        "--band-hz LOW HIGH",
        "Band of the fit. Default: 0.15 to 30; at most 0.4 times the slowest channel's rate, and "
        "a sixteenth of it where torque and motion are all there is.",
    )
    controller: tuple[float, float] | None = ESTIMATE.further(
        "--controller J_C B_C",
        "Inertia in kg·m² and damping in N·m·s/rad of the admittance, for files without a "
        "manifest. Default: those of the settings, else the paper's where the perturbation or the "
        "command was recorded, and else no loop is assumed. A wrong value makes iv less "
        "precise but does not bias it.",
    )
    keep_active: bool = ESTIMATE.flag(
        "--keep-active",
        "Fit stretches in which the EMG shows an active muscle, too. Default: they are left out.",
        hidden=True,
    )
    settings: Path | None = SETTINGS

    def read(self) -> Recording:
        """Read every input, with the band and the controller of the options in its settings.

        Raises
        ------
        UserError
            If an option is wrong, or not one input can be read.
        """
        from rigidimeter.analysis.reading import read, with_codes

        with Meter("read", 1.0) as meter:
            recording = read(
                self.paths,
                condition=self.condition,
                leave_out=self.leave_out or (),
                settings=self.settings,
                join=self.join,
                clock_offset=self.asked_clock_offset,
                progress=meter.advance,
                **self.of_files(),
            )
        recording = replace(recording, settings=self.adjust(recording.settings))
        return with_codes(recording) if self.blinded else recording

    @property
    def asked_clock_offset(self) -> float | str | None:
        """The clock offset in s, or ``found``."""
        try:
            return None if self.clock_offset is None else float(self.clock_offset)
        except ValueError:
            return self.clock_offset

    def of_files(self) -> dict[str, Any]:
        """Return the arguments of `recording.read` that say how a file is read.

        Raises
        ------
        UserError
            If an option is not written as NAME=VALUE.
        """
        return {
            "column": _pairs("column", self.column, "torque=Fz"),
            "unit": _pairs("unit", self.unit, "angle=deg"),
            "scale": _pairs("scale", self.scale, "'torque=2.5 Nm/V'"),
            "offset": _pairs("offset", self.offset, "'torque=0.1 V'"),
            "rate_hz": self.rate_hz,
            "reaction": self.reaction,
            "epoch_length_s": self.epoch_length_s,
            "task": cast("Task | None", self.task),
            "skip_rows": self.skip_rows,
            "names": [name.strip() for name in self.names.split(",")] if self.names else (),
            "table": self.table or "",
            "missing": self.missing or "",
            "mapping": self.mapping,
        }

    def adjust(self, settings: Settings) -> Settings:
        """Return settings with the band and the controller of the options.

        Raises
        ------
        UserError
            If a value is out of its range.
        """
        from rigidimeter.core.settings import changed_settings

        for option, change in self._changes():
            settings = changed_settings(settings, change, option)
        return settings

    def changes(self) -> dict[str, Any]:
        """Return the band and the controller of the options as values of settings.

        Raises
        ------
        UserError
            If a value is out of its range.
        """
        from rigidimeter.core.settings import Settings

        self.adjust(Settings())
        return {table: values for _, change in self._changes() for table, values in change.items()}

    def _changes(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield what each option changes in the settings, with the option as it was given."""
        if self.band_hz is not None:
            low, high = self.band_hz
            band = {
                "band_low_hz": low,
                "band_high_hz": high,
                "band_high_unknown_hz": high,
                "band_high_closed_loop_hz": high,
            }
            yield f"--band-hz {low:g} {high:g}", {"estimation": band}
        if self.controller is not None:
            inertia, damping = self.controller
            values = {"inertia_kg_m2": inertia, "damping_nm_s_rad": damping}
            yield f"--controller {inertia:g} {damping:g}", {"controller": values}
        if self.keep_active:
            yield "--keep-active", {"estimation": {"leave_out_active": False}}


def plain_recordings(path: Path) -> Recordings:
    """Return what to read without any option."""
    defaults = {each.name: cast(Any, each.default).default for each in fields(Recordings)}
    return Recordings(**{**defaults, "paths": [path]})


def reads_recordings(command: Callable[..., None]) -> Callable[..., None]:
    """Replace a command's first parameter, a `Recordings`, by the options that make one."""
    shared = inspect.signature(Recordings).parameters
    own = list(inspect.signature(command).parameters.values())[1:]
    hints = {
        **get_type_hints(command, include_extras=True),
        **get_type_hints(Recordings, include_extras=True),
    }

    @functools.wraps(command)
    def with_options(**given: object) -> None:
        reading = {name: given.pop(name) for name in shared}
        command(Recordings(**reading), **given)  # type: ignore[arg-type]

    with_options.__signature__ = inspect.Signature(  # type: ignore[attr-defined]
        [
            parameter.replace(kind=inspect.Parameter.KEYWORD_ONLY, annotation=hints[parameter.name])
            for parameter in (*shared.values(), *own)
        ]
    )
    with_options.__annotations__ = {**hints, "return": None}
    del with_options.__wrapped__
    return with_options


def _pairs(option: str, pairs: list[str] | None, example: str) -> dict[str, str]:
    found: dict[str, str] = {}
    for pair in pairs or ():
        name, equals, text = pair.partition("=")
        if not (name and equals and text):
            raise UserError(
                f"--{option} {pair}: write NAME={'COLUMN' if option == 'column' else 'VALUE'}, for "
                f"example --{option} {example}"
            )
        if name in found:
            raise UserError(f"--{option} {pair}: {name} was already given as {found[name]}")
        found[name] = text
    return found
