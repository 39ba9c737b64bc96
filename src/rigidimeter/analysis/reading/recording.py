"""`read`: session folders and files of any known format become one `Recording`."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape
from os import PathLike
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING, Any

import rigidimeter
from rigidimeter.analysis.reading.channels.joining import join_tables, joined_options, offset_notice
from rigidimeter.analysis.reading.channels.mapping_file import merged, read_mapping
from rigidimeter.analysis.reading.formats import (
    ReadOptions,
    read_recording,
    read_table,
    settings_in_file,
)
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.analysis.reading.leave_out import with_left_out
from rigidimeter.core.errors import UserError
from rigidimeter.core.files import is_dictionary, noted_digests
from rigidimeter.core.records import Epoch, Notice, Task
from rigidimeter.core.settings import Settings, load_settings, settings_from
from rigidimeter.core.words import html_table, one_line, plural, short_names

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

_RECORDED_WITH = ("controller", "guard", "prbs", "sinusoid", "rig")
_ANALYSED_WITH = ("estimation", "scores")


@dataclass(frozen=True)
class Recording:
    """What was read: epochs, what to say of them, and the settings to analyse them with.

    Parameters
    ----------
    epochs : tuple of Epoch
        In the order of the paths and, within each, of the file; at least one.
    notices : tuple of Notice
        What was wrong or looked wrong. A path that could not be read has one of level `error`.
    settings : Settings
        Those given, else those of the first session folder, else the defaults.
    paths : tuple of Path
        What was asked for, each once.
    digests : mapping of Path to str
        SHA-256 of every file that was read, as it was then.
    own_rig : bool
        Whether a session folder was read, so that `settings` are those of the rig.
    """

    epochs: tuple[Epoch, ...]
    notices: tuple[Notice, ...]
    settings: Settings
    paths: tuple[Path, ...]
    digests: Mapping[Path, str] = field(default_factory=dict)
    own_rig: bool = False

    @property
    def failed(self) -> bool:
        """Whether something that was asked for could not be read."""
        return any(notice.level == "error" for notice in self.notices)

    def plot(
        self,
        epoch: int = 0,
        *,
        span_s: float | None = 7.0,
        axes: Sequence[Axes] | None = None,
    ) -> NDArray[Any]:
        """Draw perturbation, torque and angle of one epoch as recorded, not filtered.

        The velocity is drawn if there is no angle. Angles are in degrees.

        Parameters
        ----------
        epoch : int
            Place in `epochs`.
        span_s : float or None
            How much is drawn, in s from the start of the epoch; None for all of it.
        axes : matplotlib Axes, optional
            To draw on, one for each channel; without them a new figure is made.

        Returns
        -------
        array of matplotlib Axes, shape (number of channels,)

        Raises
        ------
        IndexError
            If there is no such epoch.
        """
        return rigidimeter.plot(self, epoch=epoch, span_s=span_s, axes=axes)

    def __repr__(self) -> str:
        """Return what was read as one line."""
        named = [path.name or str(path) for path in self.paths]
        more = f" and {len(named) - 3} more" if len(named) > 3 else ""
        counts = Counter(epoch.condition for epoch in self.epochs)
        length_s, rate_hz = _length_and_rate(self.epochs)
        return one_line(
            f"{', '.join(named[:3])}{more}",
            f"{plural(len(self.epochs), 'epoch')} of {length_s} s at {rate_hz} samples/s",
            ", ".join(f"{name} {count}" for name, count in counts.items() if name),
            ", ".join(dict.fromkeys(name for epoch in self.epochs for name in epoch.channels)),
            plural(len(self.notices), "notice") if self.notices else "",
        )

    def _repr_html_(self) -> str:
        """Return a table with a row for each source and condition, and the notices."""
        parts: dict[tuple[str, str], list[Epoch]] = {}
        for epoch in self.epochs:
            parts.setdefault((epoch.source, epoch.condition), []).append(epoch)
        names = short_names(source for source, _ in parts)
        rows = [
            [
                *(names[source], condition, str(len(own))),
                *(*_length_and_rate(own), ", ".join(own[0].channels)),
            ]
            for (source, condition), own in parts.items()
        ]
        heading = ["recording", "condition", "epochs", "length, s", "samples/s", "channels"]
        notices = [f"<p>{escape(f'{one.level}: {one.text}')}</p>" for one in self.notices]
        return "\n".join([html_table(heading, rows), *notices])


def _length_and_rate(epochs: Iterable[Epoch]) -> tuple[str, str]:
    """Return the median length in s and the median rate in samples/s of the fastest channel."""
    longest = [max(epoch.channels.values(), key=len) for epoch in epochs if epoch.channels]
    stamped = [channel for channel in longest if len(channel) > 1]
    if not stamped:
        return "–", "–"
    length_s = median(float(one.time_s[-1] - one.time_s[0]) + 1 / one.rate_hz for one in stamped)
    return f"{length_s:.3g}", f"{median(one.rate_hz for one in stamped):.4g}"


def read(
    paths: str | Path | Sequence[str | Path],
    *,
    column: Mapping[str, str] | None = None,
    rate_hz: float | None = None,
    reaction: bool = False,
    epoch_length_s: float | None = None,
    condition: str | Sequence[str] | None = None,
    task: Task | None = None,
    leave_out: Sequence[str] = (),
    unit: Mapping[str, str] | None = None,
    scale: Mapping[str, str] | None = None,
    offset: Mapping[str, str] | None = None,
    skip_rows: int = 0,
    names: Sequence[str] = (),
    table: str = "",
    missing: str | Sequence[float] = "",
    mapping: str | Path | None = None,
    join: bool = False,
    clock_offset: float | str | None = None,
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
    progress: Callable[[float], None] = lambda _: None,
) -> Recording:
    """Read session folders and files into one recording.

    What cannot be read becomes a notice of level `error`; the rest is read all the same.

    Parameters
    ----------
    paths : path or sequence of paths
        Session folders, or files of any format in `rigidimeter.analysis.reading.formats.READERS`.
    column : mapping of str to str, optional
        Quantity to the file's own name of a column, as in ``{"torque": "Fz"}``; ``torque_nm`` says
        its unit too.
    rate_hz : float, optional
        Sampling rate in Hz of files without a time column.
    reaction : bool
        The torque is what the joint does to the robot, the negative of what drives the joint.
    epoch_length_s : float, optional
        Cut files without an epoch column into epochs of this length, in s.
    condition : str or sequence of str, optional
        Condition of files without a condition column: one for all, or one for each path.
    task : {"prbs", "sinusoid"}, optional
        Task of files without a task column.
    leave_out : sequence of str
        What no estimate uses: ``START:STOP REASON``, in s on the recording's clock, with ``NAME=``
        before it where there are several recordings. The reason may be left away.
    unit : mapping of str to str, optional
        Quantity to the unit of its column, as in ``{"angle": "deg"}``, where the file does not
        state it.
    scale : mapping of str to str, optional
        What a column is multiplied by, as in ``{"torque": "2.5 Nm/V"}``, or ``"0.25 m"`` for
        a force with a lever arm.
    offset : mapping of str to str, optional
        What a column reads at zero, as in ``{"torque": "0.1 V"}``.
    skip_rows : int
        Lines at the beginning of a text file that are not read.
    names : sequence of str
        Of the columns of a text file that does not name them.
    table : str
        The sheet that is read, of a file with several.
    missing : str or sequence of float
        The numbers that stand for lost samples of torque and motion, as in ``(0, -999)``;
        ``"none"`` where no number does. Default: found, where one recurs alone and far from the
        samples beside it.
    mapping : path, optional
        A mapping file, which says all of this but the conditions; an argument comes before it.
    join : bool
        The paths are parts of one recording, such as torque and motion, each with its clock.
    clock_offset : float or "found", optional
        With `join`, what is added to the clocks of the second and later paths, in s; ``"found"``:
        estimated from torque and motion, and reported with its error.
    settings : Settings, path or mapping, optional
        Settings for the analysis, or a TOML file of them. Default: those with which the first
        session folder was recorded, else the built-in ones.
    progress : callable
        Called with the share of the bytes that was read since, 1 in all; not with `join`.

    Returns
    -------
    Recording

    Raises
    ------
    UserError
        If an argument is wrong, or if nothing could be read.

    Examples
    --------
    >>> import numpy as np, rigidimeter as rm
    >>> t = np.arange(3000) / 100
    >>> angle = 3 * np.sin(2 * t) + 2 * np.sin(9 * t)  # deg
    >>> rows = np.column_stack([t, np.sin(2 * t) + 0.1, angle])
    >>> np.savetxt("mine.csv", rows, delimiter=",", header="time_s,Fz,angle", comments="")
    >>> recording = rm.read("mine.csv", column={"torque_nm": "Fz"}, unit={"angle": "deg"})
    >>> [(epoch.label, sorted(epoch.channels)) for epoch in recording.epochs]
    [('1', ['angle_rad', 'torque_nm'])]
    """
    asked = _paths(paths)
    conditions = _conditions(condition, len(asked))
    options = read_options(
        column=column,
        rate_hz=rate_hz,
        reaction=reaction,
        epoch_length_s=epoch_length_s,
        task=task,
        unit=unit,
        scale=scale,
        offset=offset,
        skip_rows=skip_rows,
        names=names,
        table=table,
        missing=missing if isinstance(missing, str) else ",".join(f"{one:g}" for one in missing),
        mapping=mapping,
    )
    chosen = None if settings is None else settings_from(settings)
    if clock_offset is not None and not join:
        raise UserError("--clock-offset: is for recordings that are joined; say --join")
    if not join:
        named = dict(zip(asked, conditions, strict=True))
        return read_as(named, options, chosen, leave_out, progress)
    with noted_digests() as digests:
        epochs, notices = read_joined(
            asked, replace(options, condition=conditions[0]), clock_offset
        )
    used = chosen or load_settings(None)
    paths_read = tuple(dict.fromkeys(asked))
    joined_recording = Recording(tuple(epochs), tuple(notices), used, paths_read, digests)
    return _complete(joined_recording, leave_out)


def read_joined(
    paths: Sequence[Path], options: ReadOptions, clock_offset: float | str | None
) -> tuple[list[Epoch], list[Notice]]:
    """Return the epochs of paths that are parts of one recording.

    Raises
    ------
    UserError
        If they cannot be read, or do not belong together.
    """
    tables = [read_table(path, options) for path in paths]
    joined, found = join_tables(tables, options, clock_offset)
    epochs, notices = epochs_from_table(joined, joined_options(options))
    if found is not None and epochs:
        notices.insert(0, offset_notice(found, tables[1].source))
        epochs = [replace(epoch, clock_error_s=found.error_s) for epoch in epochs]
    return epochs, notices


def read_as(
    named: Mapping[Path, str],
    options: ReadOptions,
    chosen: Settings | None,
    leave_out: Sequence[str] = (),
    progress: Callable[[float], None] = lambda _: None,
) -> Recording:
    """Read paths, each with its condition, with options and settings that are made already.

    Raises
    ------
    UserError
        If nothing could be read.
    """
    compared = _RECORDED_WITH if chosen is not None else (*_RECORDED_WITH, *_ANALYSED_WITH)
    first: Settings | None = None
    epochs: list[Epoch] = []
    notices: list[Notice] = []
    digests: dict[Path, str] = {}
    sizes = {path: _size(path) for path in named}
    total = sum(sizes.values()) or 1
    begun = 0
    for path, name in named.items():
        progress(begun / total)
        begun = sizes[path]
        try:
            with noted_digests() as noted:
                recorded = settings_in_file(path)
                found, remarks = read_recording(path, replace(options, condition=name))
        except UserError as error:
            notices += [Notice("error", line) for line in error.lines]
            continue
        if recorded is not None:
            first = first or recorded
            notices += _about_settings(path, recorded, first, compared)
        digests |= noted
        epochs += found
        notices += remarks
    progress(begun / total)
    settings = chosen or first or load_settings(None)
    recording = Recording(
        tuple(epochs), tuple(notices), settings, tuple(named), digests, first is not None
    )
    return _complete(recording, leave_out)


def _size(path: Path) -> int:
    """Return the bytes of a file or folder, as far as they can be looked at."""
    try:
        files = path.rglob("*") if path.is_dir() else [path]
        return sum(file.stat().st_size for file in files if file.is_file())
    except (OSError, ValueError):
        return 0


def _complete(found: Recording, leave_out: Sequence[str]) -> Recording:
    """Return what was read without what the user leaves out; refuse a recording of nothing."""
    if not found.epochs:
        raise UserError(*[n.text for n in found.notices] or ["no epoch was found"])
    epochs, remarks = with_left_out(found.epochs, leave_out)
    return replace(found, epochs=tuple(epochs), notices=(*found.notices, *remarks))


def read_options(
    *,
    column: Mapping[str, str] | None = None,
    unit: Mapping[str, str] | None = None,
    scale: Mapping[str, str] | None = None,
    offset: Mapping[str, str] | None = None,
    names: Sequence[str] = (),
    mapping: str | Path | None = None,
    **others: Any,
) -> ReadOptions:
    """Return arguments of `read` as options, with those of the mapping file behind them.

    `others` are named alike in `ReadOptions`.

    Raises
    ------
    UserError
        If one is wrong.
    """
    options = ReadOptions(
        columns=_by_name("column", column, "'torque': 'Fz'"),
        units=_by_name("unit", unit, "'angle': 'deg'"),
        scales=_by_name("scale", scale, "'torque': '2.5 Nm/V'"),
        offsets=_by_name("offset", offset, "'torque': '0.1 V'"),
        names=tuple(names),
        **others,
    )
    return options if mapping is None else merged(read_mapping(Path(mapping)), options)


def _about_settings(
    path: Path, recorded: Settings, first: Settings, compared: Sequence[str]
) -> list[Notice]:
    differing = [name for name in compared if getattr(recorded, name) != getattr(first, name)]
    if not differing:
        return []
    text = (
        f"{path}: was recorded with other settings than the first session in "
        f"{', '.join(differing)}; the analysis and the report use those of the first for all"
    )
    return [Notice("warning", text)]


def _paths(paths: object) -> list[Path]:
    several = [paths] if isinstance(paths, str | PathLike) else paths
    given: list[Any] = [*several] if isinstance(several, Iterable) else [several]
    for one in given:
        if not isinstance(one, str | PathLike):
            raise UserError(f"what to read is a path or a list of paths, not {one!r}")
    found = [Path(one) for one in given]
    return [one for one in found if not is_dictionary(one)] or found  # a shell names them too


def _by_name(argument: str, given: object, example: str) -> dict[str, str]:
    found = {} if given is None else given
    if not isinstance(found, Mapping) or not all(isinstance(n, str) for n in found.values()):
        raise UserError(f"{argument} maps quantities to texts, as in {{{example}}}; got {given!r}")
    return dict(found)


def _conditions(condition: str | Sequence[str] | None, n_paths: int) -> list[str]:
    if not isinstance(condition, str | Sequence | None):
        raise UserError(f"condition is a name, or one for each path, not {condition!r}")
    names = [condition or ""] if condition is None or isinstance(condition, str) else [*condition]
    if len(names) == 1:
        return names * n_paths
    if len(names) != n_paths:
        raise UserError(
            f"--condition was given {len(names)} times for {n_paths} inputs; give it once for all "
            "of them, or once for each in their order"
        )
    return names
