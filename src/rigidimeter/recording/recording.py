"""`read`: session folders and files of any known format become one `Recording`."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path
from typing import Any

from rigidimeter.documents import noted_digests
from rigidimeter.errors import UserError
from rigidimeter.recording.formats import ReadOptions, read_recording, reader_of
from rigidimeter.recording.leave_out import with_left_out
from rigidimeter.records import Epoch, Notice, Task
from rigidimeter.settings import Settings, load_settings, settings_from

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
    """

    epochs: tuple[Epoch, ...]
    notices: tuple[Notice, ...]
    settings: Settings
    paths: tuple[Path, ...]
    digests: Mapping[Path, str] = field(default_factory=dict)

    @property
    def failed(self) -> bool:
        """Whether something that was asked for could not be read."""
        return any(notice.level == "error" for notice in self.notices)


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
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
) -> Recording:
    """Read session folders and files into one recording.

    What cannot be read becomes a notice of level `error`; the rest is read all the same.

    Parameters
    ----------
    paths : path or sequence of paths
        Session folders, or files of any format in `rigidimeter.recording.formats.READERS`.
    column : mapping of str to str, optional
        Standard name to the file's own name of a column, as in ``{"torque_nm": "Fz"}``.
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
    settings : Settings, path or mapping, optional
        Settings for the analysis, or a TOML file of them. Default: those with which the first
        session folder was recorded, else the built-in ones.

    Returns
    -------
    Recording

    Raises
    ------
    UserError
        If an argument is wrong, or if nothing could be read.
    """
    asked = _paths(paths)
    conditions = _conditions(condition, len(asked))
    options = ReadOptions(_columns(column), rate_hz, reaction, epoch_length_s, task=task)
    chosen = None if settings is None else settings_from(settings)
    compared = _RECORDED_WITH if chosen is not None else (*_RECORDED_WITH, *_ANALYSED_WITH)
    first: Settings | None = None
    epochs: list[Epoch] = []
    notices: list[Notice] = []
    digests: dict[Path, str] = {}
    for path, name in dict(zip(asked, conditions, strict=True)).items():
        try:
            with noted_digests() as noted:
                reader = reader_of(path)
                recorded = None if reader.settings is None else reader.settings(path)
                found, remarks = read_recording(path, replace(options, condition=name))
        except UserError as error:
            notices.append(Notice("error", str(error)))
            continue
        if recorded is not None:
            first = first or recorded
            notices += _about_settings(path, recorded, first, compared)
        digests |= noted
        epochs += found
        notices += remarks
    if not epochs:
        raise UserError(" / ".join(n.text for n in notices) or "no epoch was found")
    epochs, remarks = with_left_out(epochs, leave_out)
    notices += remarks
    return Recording(
        tuple(epochs),
        tuple(notices),
        chosen or first or load_settings(None),
        tuple(dict.fromkeys(asked)),
        digests,
    )


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
    return [Path(one) for one in given]


def _columns(column: object) -> dict[str, str]:
    given = {} if column is None else column
    if not isinstance(given, Mapping) or not all(isinstance(n, str) for n in given.values()):
        raise UserError(
            "column maps standard names to the names in the file, as in {'torque_nm': 'Fz'}; "
            f"got {column!r}"
        )
    return dict(given)


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
