"""One estimate from arrays, as a notebook has them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from rigidimeter.analysis.estimation import (
    Array,
    choose_method,
    estimate_recorded,
    method_named,
    prepare,
)
from rigidimeter.analysis.reading.channels.looks import look
from rigidimeter.analysis.reading.channels.readings import confusions, doubts
from rigidimeter.core.records import CHANNEL_UNITS, Channel, Epoch, Fit, readonly
from rigidimeter.core.settings import Settings, settings_from


def identify(
    *,
    torque_nm: ArrayLike,
    angle_rad: ArrayLike | None = None,
    velocity_rad_s: ArrayLike | None = None,
    velocity_command_rad_s: ArrayLike | None = None,
    perturbation_nm: ArrayLike | None = None,
    rate_hz: float | None = None,
    time_s: ArrayLike | None = None,
    method: str = "auto",
    settings: Settings | str | Path | Mapping[str, Any] | None = None,
    check_units: bool = True,
) -> Fit:
    """Estimate inertia J, damping B and stiffness K from one stretch of recording.

    The numbers are those that ``rigidimeter estimate`` gives for the same data as one epoch: a
    delay of the torque is corrected where it is known, and every check is made.

    Parameters
    ----------
    torque_nm : array, shape (n,)
        Positive when it drives the joint toward positive angle.
    angle_rad, velocity_rad_s : array, shape (n,), optional
        The measured motion; one of them at least.
    velocity_command_rad_s : array, shape (n,), optional
        Sent to the drive.
    perturbation_nm : array, shape (n,), optional
        The commanded torque. With it voluntary torque does not bias the estimate.
    rate_hz : float, optional
        The sampling rate of all arrays.
    time_s : array, shape (n,), optional
        When the samples were taken, increasing; instead of `rate_hz`.
    method : str
        The name of an estimator, or ``auto``: ``iv`` with the perturbation, else ``bandlimited``.
    settings : Settings, path or mapping, optional
    check_units : bool
        Refuse arrays whose numbers contradict their units, as a file is refused.

    Returns
    -------
    Fit
        With the findings of the checks. Its outcome is ``excluded``, with the reason, where the
        estimate should not be used.

    Raises
    ------
    ValueError
        If an array has the wrong shape, numbers that are not finite or, by its numbers, another
        unit (an angle in degrees), if there is no such method
        or it lacks a channel, or if nothing could be estimated; the text says why.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(20_000) / 1000
    >>> angle = sum(np.sin(2 * np.pi * f * t + f**2) / f for f in (0.3, 0.7, 1.5, 3.1, 6.1)) / 50
    >>> velocity = np.gradient(angle, t)
    >>> torque = 0.005 * np.gradient(velocity, t) + 0.14 * velocity + 1.8 * angle
    >>> fit = identify(torque_nm=torque, angle_rad=angle, rate_hz=1000)
    >>> f"K = {fit.stiffness_nm_rad:.2f} N·m/rad"
    'K = 1.80 N·m/rad'
    """
    settings = settings_from(settings)
    given = {
        "torque_nm": torque_nm,
        "angle_rad": angle_rad,
        "velocity_rad_s": velocity_rad_s,
        "velocity_command_rad_s": velocity_command_rad_s,
        "perturbation_nm": perturbation_nm,
    }
    arrays = {name: _array(name, values) for name, values in given.items() if values is not None}
    if "torque_nm" not in arrays:
        raise ValueError("torque_nm is None; the measured torque is needed")
    size = arrays["torque_nm"].size
    for name, values in arrays.items():
        if values.size != size:
            raise ValueError(f"{name} has {values.size} samples, but torque_nm has {size}")
    stamps = _stamps(size, rate_hz, time_s)
    if check_units:
        _refuse_units(stamps, arrays)
    channels = {name: Channel(name, stamps, values) for name, values in arrays.items()}
    epoch = Epoch("arrays", "1", channels, task="prbs")
    recorded = prepare([epoch], settings)
    if method == "auto":
        method, _ = choose_method(recorded.perturbed)
    lacking = [name for name in method_named(method).needs if name not in channels]
    if lacking:
        raise ValueError(f"method {method} needs {' and '.join(lacking)}")
    (fit,) = estimate_recorded(recorded, method).fits
    if fit.outcome.kind == "failed":
        raise ValueError(f"method {method}: {fit.outcome.reason}")
    return fit


def _refuse_units(time_s: Array, arrays: Mapping[str, Array]) -> None:
    """Refuse units that the numbers contradict, as for a file that states the same units."""
    motion = [name for name in ("angle_rad", "velocity_rad_s") if name in arrays]
    if not motion or time_s.size < 2:
        return
    beside = (time_s, arrays["velocity_rad_s"]) if len(motion) == 2 else None
    seen = look(
        (time_s, arrays["torque_nm"]),
        (time_s, arrays[motion[0]]),
        beside,
        is_angle=motion[0] == "angle_rad",
    )
    for doubt in doubts(seen) or confusions(seen, dict.fromkeys(arrays, 1.0)):
        unit = CHANNEL_UNITS.get(doubt.standard, "s")
        raise ValueError(
            f"{doubt.standard} is taken to be in {unit}, but {doubt.text}; give it in {unit}, or "
            "say check_units=False if it is"
        )


def _array(name: str, values: ArrayLike) -> Array:
    if np.iscomplexobj(values) or np.ma.is_masked(values):
        raise ValueError(f"{name} has complex or masked samples; samples must be finite numbers")
    try:
        array = readonly(values)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} is not an array of numbers ({error})") from None
    if array.ndim != 1:
        raise ValueError(f"{name} must have one dimension, not the shape {array.shape}")
    if not np.all(np.isfinite(array)):
        bad = int(np.argmin(np.isfinite(array)))
        raise ValueError(f"{name} is {array[bad]} at sample {bad}; samples must be finite numbers")
    return array


def _stamps(size: int, rate_hz: float | None, time_s: ArrayLike | None) -> Array:
    if (rate_hz is None) == (time_s is None):
        raise ValueError("give either rate_hz or time_s")
    if time_s is not None:
        stamps = _array("time_s", time_s)
        if stamps.size != size:
            raise ValueError(f"time_s has {stamps.size} samples, but torque_nm has {size}")
        if np.any(np.diff(stamps) <= 0):
            raise ValueError("time_s must increase from sample to sample")
        return stamps
    if not (isinstance(rate_hz, Real) and math.isfinite(rate_hz) and rate_hz > 0):
        raise ValueError(f"rate_hz must be a number greater than 0, got {rate_hz!r}")
    return readonly(np.arange(size) / rate_hz)
