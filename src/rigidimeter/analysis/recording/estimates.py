"""Estimates of a recording, unpacked: its epochs and settings are what is estimated from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rigidimeter.analysis import estimation
from rigidimeter.analysis.estimation import Progress
from rigidimeter.analysis.reading import Recording
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Epoch
from rigidimeter.core.settings import Settings, settings_from


def estimate(
    recording: Recording | Iterable[Epoch],
    method: str = "auto",
    *,
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
    progress: Progress = lambda _: None,
) -> Analysis:
    """Estimate J, B and K of every epoch, and score the imposed sinusoids.

    Parameters
    ----------
    recording : Recording or iterable of Epoch
    method : str
        The name of an estimator; ``auto`` chooses by what was recorded.
    settings : Settings, path or mapping, optional
        Instead of those of the recording.
    progress : callable
        Called with the share of the work that was done since, 1 in all.

    Returns
    -------
    Analysis
        `table()` gives its epochs as a pandas table, `pooled` the estimates of all epochs together,
        `findings` what the checks found; in a notebook it shows itself as a table.

    Raises
    ------
    ValueError
        If there is no such method.
    UserError
        If `recording` is neither, such as a path; the settings are wrong.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> estimates = rm.estimate(rm.data("elbow"))
    >>> estimates.method, len(estimates.fits)
    ('iv', 6)
    >>> estimates.table().groupby("condition")["stiffness_nm_rad"].median().round(2).to_dict()
    {'DBS': 1.44, 'OFF': 1.75}
    """
    if isinstance(recording, Recording):
        epochs: tuple[Any, ...] = recording.epochs
        settings = recording.settings if settings is None else settings
    else:
        epochs = tuple(recording) if isinstance(recording, Iterable) else (None,)
    if not all(isinstance(epoch, Epoch) for epoch in epochs):
        raise UserError(
            "estimate takes a Recording or a list of its epochs; read a path with rigidimeter.read"
        )
    if method not in estimation.method_names():
        raise ValueError(f"method {method!r}: {estimation.no_such_method(method)}")
    return estimation.estimate(epochs, settings_from(settings), method, progress=progress)
