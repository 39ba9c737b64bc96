"""What a file does not say of itself, and the user does."""

from __future__ import annotations

import math
import shlex
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from numbers import Real
from typing import get_args

from rigidimeter.analysis.reading.channels.choice import LABELS, STANDARD, Said
from rigidimeter.analysis.reading.channels.quantities import BY_STANDARD, QUANTITIES, standard_of
from rigidimeter.analysis.reading.formats.table import nearest
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import SAMPLING_RATE_HZ
from rigidimeter.core.records import Task

_BY_NAME = {one.name: one.standard for one in QUANTITIES}


@dataclass(frozen=True)
class ReadOptions:
    """What a file does not say of itself.

    Parameters
    ----------
    columns : mapping of str to str
        Quantity to the file's name of a column: ``angle_rad`` states its unit, ``angle`` does not.
    rate_hz : float or None
        The sampling rate, for files without a time column.
    reaction : bool
        The torque is the joint's reaction: its sign is turned.
    epoch_length_s : float or None
        Cut a file without an epoch column into epochs of this length.
    condition : str
        For files without a condition column.
    task : {"prbs", "sinusoid"} or None
        For files without a task column.
    units, scales, offsets : mapping of str to str
        Quantity to the unit of its column, what its values are multiplied by (``2.5 Nm/V``), and
        what it reads at zero.
    skip_rows : int
        Lines at the beginning of a text that are not read.
    names : tuple of str
        Of the columns of a text that does not name them.
    table : str
        The sheet that is read, of a file with several.
    missing : str
        The numbers, with commas between them, that stand for lost samples of torque and motion;
        ``none`` where no number does. Where nothing is given they are found.

    Raises
    ------
    UserError
        If a value is out of its range.
    """

    columns: Mapping[str, str] = field(default_factory=dict)
    rate_hz: float | None = None
    reaction: bool = False
    epoch_length_s: float | None = None
    condition: str = ""
    task: Task | None = None
    units: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, str] = field(default_factory=dict)
    offsets: Mapping[str, str] = field(default_factory=dict)
    skip_rows: int = 0
    names: tuple[str, ...] = ()
    table: str = ""
    missing: str = ""

    def __post_init__(self) -> None:
        positive = (
            ("--rate-hz", self.rate_hz, "the sampling rate", "Hz"),
            ("--epoch-length-s", self.epoch_length_s, "the length", "s"),
        )
        for option, value, what, unit in positive:
            if value is not None and not isinstance(value, Real):
                raise UserError(f"{option} {value!r}: {what} must be a number")
            if value is not None and not 0 < value < math.inf:
                raise UserError(f"{option} {value:g}: {what} must be greater than 0 {unit}")
        low_hz, high_hz = SAMPLING_RATE_HZ
        if self.rate_hz is not None and not low_hz <= self.rate_hz <= high_hz:
            raise UserError(
                f"--rate-hz {self.rate_hz:g}: the sampling rate must be from {low_hz:g} to "
                f"{high_hz:g} Hz"
            )
        if not isinstance(self.skip_rows, int) or self.skip_rows < 0:
            raise UserError(f"--skip-rows {self.skip_rows}: must be a whole number of at least 0")
        if self.task not in (None, *get_args(Task)):
            raise UserError(f"--task {self.task}: must be {' or '.join(get_args(Task))}")
        _ = self.missing_values, self.said  # refuses what is not a quantity

    @cached_property
    def missing_values(self) -> tuple[float, ...] | None:
        """The numbers that stand for lost samples; None where they are to be found."""
        if self.missing in ("", "none"):
            return () if self.missing else None
        try:
            values = tuple(float(text) for text in self.missing.split(","))
        except ValueError:
            values = (math.nan,)
        if not all(map(math.isfinite, values)):
            raise UserError(
                f"--missing {self.missing}: must be numbers with commas between them, as in "
                "--missing 0,-999, or none"
            )
        return values

    @cached_property
    def said(self) -> Said:
        """What is said of the columns, by standard name."""
        columns: dict[str, str] = {}
        for name, column in self.columns.items():
            standard = _BY_NAME.get(name, name)
            if standard not in STANDARD:
                raise UserError(
                    f"--column {shlex.quote(f'{name}={column}')}: {name} is not a name that is "
                    f"read; the nearest is {nearest(name, STANDARD)} (known are "
                    f"{', '.join((*_BY_NAME, *LABELS))}, and {', '.join(BY_STANDARD)})"
                )
            columns[standard] = column
        of_channels = [
            {standard_of(name, f"--{option} {name}={text}"): text for name, text in given.items()}
            for option, given in (
                ("unit", self.units), ("scale", self.scales), ("offset", self.offsets),
            )
        ]  # fmt: skip
        return Said(columns, frozenset(self.columns) & frozenset(BY_STANDARD), *of_channels)
