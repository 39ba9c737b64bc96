"""A whole session on an exact rig, and all that is told of it."""

from typing import NamedTuple

from tests.unit.rig.acquisition.exact_rig import ExactRig, LateClock

from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import Run, SessionResult, run_session

RATE_HZ = 50.0
SENSOR = {"rate_hz": RATE_HZ}
VALUES = {
    "rig": {"tick_rate_hz": RATE_HZ, "torque": SENSOR, "motion": SENSOR},
    "guard": {"reaction_time_s": 0.08},
    "loop": {"stall_s": 1.0},
    "prbs": {"duration_s": 1.0},
    "sinusoid": {"duration_s": 1.0, "motion_s": 1.0, "amplitude_deg": 1.0, "taper_s": 0.1},
    "protocol": {"blocks": [{"epochs": 2}], "rests_s": [0.6], "return_s": 0.5},
    "zeroing": {"duration_s": 0.4},
}
EPOCH, REST, RETURN, LOOK = 50, 30, 25, 5
"""In ticks."""

STOP = 2 * LOOK
"""In ticks: the drive has settled 0.16 s after the last command, and it is looked after each 0.1 s.
"""

HAND_KG_M2 = 0.0045


class ListSink:
    """Keeps everything in order."""

    def __init__(self):
        self.samples, self.events, self.closed = [], [], []
        self.sample = self.samples.append

    def event(self, kind, **facts):
        self.events.append({"event": kind, **facts})

    def close(self, time_s, outcome, reason):
        self.closed.append((time_s, outcome, reason))

    def of(self, kind):
        return [event for event in self.events if event["event"] == kind]


class Ran(NamedTuple):
    """What came of it."""

    result: SessionResult | None
    error: BaseException | None
    rig: ExactRig
    sink: ListSink
    states: list[Run]

    @property
    def epochs(self):
        """The numbers of the epochs, with how each ended."""
        return [(e["epoch"], e["outcome"]) for e in self.sink.of("epoch_ended")]

    @property
    def labels(self):
        return [e["label"] for e in self.sink.of("epoch_started")]


def session(desk=None, *, change=lambda tick, reading: reading, late=None, values=None, **options):
    """Run a session; `change` says what is in each reading, `values` other settings.

    `clock`, `rig` and `sink` are others than those made here.
    """
    settings = parse_settings({**VALUES, **(values or {})})
    interval_s = 1.0 / settings.rig.tick_rate_hz
    rig = options.pop("rig", None) or ExactRig(change, interval_s, HAND_KG_M2)
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, 1)
    clock = options.pop("clock", None) or LateClock(late, interval_s)
    sink, states = options.pop("sink", None) or ListSink(), []
    result, error = None, None
    try:
        result = run_session(
            protocol,
            settings,
            rig,
            clock,
            sink,
            supervision=desk,
            **{"state_changed": states.append, **options},
        )
    except Exception as caught:
        error = caught
    return Ran(result, error, rig, sink, states)
