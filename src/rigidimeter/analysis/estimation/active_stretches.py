"""Stretches in which a muscle was active by itself are left out, as any stretch is.

Which they are is decided from the EMG alone (`muscle_activity`), for what is chosen by torque or
motion biases B and K. For the same reason bursts that follow the motion stay in (`follows_motion`):
without them the joint would be another one.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rigidimeter.analysis.estimation.bad_stretches import leaving_out
from rigidimeter.analysis.estimation.follows_motion import follows_motion
from rigidimeter.analysis.estimation.muscle_activity import (
    baseline_v,
    bursts,
    cocontraction_percent,
    emg_channels,
    envelope,
    joined,
    share_percent,
)
from rigidimeter.core.records import ActiveStretch, Activity, Channel, Epoch, LeftOut
from rigidimeter.core.settings import Settings

CHECK = "emg_activity"

TORQUE_OUTLASTS_S = 0.2
"""A muscle still pulls when its EMG is over; so much is left out after a burst too."""


def activities(
    recorded: Sequence[Epoch], fitted: Sequence[Epoch], settings: Settings
) -> list[tuple[Epoch, Activity | None]]:
    """Return epochs without their active stretches, and what the EMG shows.

    Rest and the largest envelope of a muscle are those of its recording.

    Parameters
    ----------
    recorded : sequence of Epoch
        As they were recorded.
    fitted : sequence of Epoch
        The same, without the stretches in which a sensor did not measure.
    settings : Settings
    """
    envelopes = [{emg.name: envelope(emg) for emg in emg_channels(epoch)} for epoch in recorded]
    muscles: dict[tuple[str, str], list[Channel]] = {}
    for epoch, each in zip(recorded, envelopes, strict=True):
        for name, one in each.items():
            muscles.setdefault((epoch.source, name), []).append(one)
    rest_v = {muscle: baseline_v(ones) for muscle, ones in muscles.items()}
    largest_v = {
        muscle: max(float(np.max(one.values)) for one in ones) for muscle, ones in muscles.items()
    }
    found: list[tuple[Epoch, Activity | None]] = []
    for epoch, without, own in zip(recorded, fitted, envelopes, strict=True):
        if not own:
            found.append((without, None))
            continue
        stretches = []
        for name, one in own.items():
            spans = bursts(one, rest_v[epoch.source, name], settings.diagnostics)
            locked = bool(spans) and follows_motion(one, epoch)
            stretches += [ActiveStretch(*span, name, locked) for span in spans]
        stretches.sort()
        wanted = _to_leave_out(stretches) if settings.estimation.leave_out_active else []
        left, kept = leaving_out(without, wanted, settings)
        length_s = max(float(one.time_s[-1] - one.time_s[0]) for one in own.values())
        active = share_percent(joined([one[:2] for one in stretches]), length_s)
        out = [one[:2] for one in left.left_out if one.check == CHECK]
        largest = [largest_v[epoch.source, name] for name in own]
        shared = cocontraction_percent([*own.values()], largest)
        out_percent = min(share_percent(out, length_s), 100.0)
        found.append((left, Activity(tuple(stretches), active, out_percent, shared, kept)))
    return found


def _to_leave_out(stretches: Sequence[ActiveStretch]) -> list[LeftOut]:
    """Return what would be left out for active muscles, but for those that follow the motion."""
    own = [(one.start_s, one.stop_s + TORQUE_OUTLASTS_S) for one in stretches if not one.locked]
    return [LeftOut(*span, "a muscle was active", CHECK) for span in joined(own)]
