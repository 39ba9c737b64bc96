"""A rig that does each command at once and exactly, and a clock that is late when told to.

What happened is in `calls`, in order. Times are those of the loop's ticks, so a test takes
milliseconds and gives the same numbers every time.
"""

import math

from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.acquisition import NOTHING, ControlLoop, Order
from rigidimeter.rig.devices.base import Reading

INTERVAL_S = 0.001
SETTINGS = parse_settings({})
CHANGE_RAD_S = math.radians(SETTINGS.guard.acceleration_limit_deg_s2) * INTERVAL_S
"""What the acceleration limit allows in one tick: 6000 deg/s² in 1 ms, 0.105 rad/s."""

LONGEST = 2000
"""In ticks: a run that takes more is one that does not end."""


class ExactRig:
    """The angle is the sum of the commands, the torque that of an inertia.

    `change` says what else is in the reading of a tick.
    """

    origin_rad = 0.25
    powered = False

    def __init__(
        self, change=lambda tick, reading: reading, interval_s=INTERVAL_S, inertia_kg_m2=0.0
    ):
        self.change, self.interval_s, self.inertia_kg_m2 = change, interval_s, inertia_kg_m2
        self.before_rad_s = 0.0
        self.counts = {"lost": 3}
        self.calls = []
        self.tick = -1
        self.angle_rad = self.velocity_rad_s = 0.0
        self.enable = lambda: self.calls.append(("enable",))
        self.disable = lambda: self.calls.append(("disable",))
        self.stop = lambda: self.calls.append(("stop",))
        self.zero = lambda bias_nm: self.calls.append(("zero", bias_nm))

    def read(self, elapsed_ticks=1):
        self.calls.append(("read", elapsed_ticks))
        self.tick += elapsed_ticks
        elapsed_s = elapsed_ticks * self.interval_s
        self.angle_rad += self.velocity_rad_s * elapsed_s
        change_rad_s = self.velocity_rad_s - self.before_rad_s
        torque_nm = self.inertia_kg_m2 * change_rad_s / elapsed_s
        self.before_rad_s = self.velocity_rad_s
        time_s = self.tick * self.interval_s
        reading = Reading(torque_nm, time_s, self.angle_rad, self.velocity_rad_s, time_s)
        return self.change(self.tick, reading)

    def write(self, velocity_rad_s):
        self.calls.append(("write", velocity_rad_s))
        self.velocity_rad_s = velocity_rad_s
        return velocity_rad_s

    @property
    def until_off(self):
        """The calls until the power was last taken away; then it is read, and told to stand."""
        end = len(self.calls) - self.calls[::-1].index(("disable",))
        assert {*self.calls[end:]} <= {("read", 1), ("write", 0.0)}
        return self.calls[:end]

    def of(self, name):
        """Return the arguments of the calls of this name."""
        return [call[1] if len(call) > 1 else None for call in self.calls if call[0] == name]


class LateClock:
    """On time, but for the ticks in `late`, which are late by so many seconds, once."""

    def __init__(self, late=None, interval_s=INTERVAL_S):
        self.late, self.interval_s = dict(late or {}), interval_s
        self.deadlines_s = []

    def wait_until(self, deadline_s):
        self.deadlines_s.append(deadline_s)
        return deadline_s + self.late.pop(round(deadline_s / self.interval_s), 0.0)


class Desk:
    """Causes and orders by the tick, the first one 0, at which they come."""

    measured = math.nan

    def __init__(self, causes=None, orders=None, attended=True):
        self.causes, self.orders, self.attended = dict(causes or {}), dict(orders or {}), attended
        self.times_s = []

    def cause(self, now_s):
        self.times_s.append(now_s)
        assert len(self.times_s) < LONGEST, "it goes on for ever"
        return int(self.causes.get(len(self.times_s) - 1, 0))

    def order(self):
        given = self.orders.pop(len(self.times_s) - 1, NOTHING)
        return given if isinstance(given, Order) else Order(given)


def made(
    settings,
    *,
    change=lambda tick, reading: reading,
    late=None,
    desk=None,
    inertia_kg_m2=0.0,
    **options,
):
    """Return a loop on an exact rig and the samples it will record."""
    samples = []
    interval_s = 1.0 / settings.rig.tick_rate_hz
    rig = ExactRig(change, interval_s, inertia_kg_m2)
    options.setdefault("record", samples.append)
    loop = ControlLoop(
        settings, rig, LateClock(late, interval_s), supervision=desk or Desk(), **options
    )
    return loop, samples


def constant(velocity_rad_s):
    """Return a controller that always asks for the same."""
    return lambda reading, torque_nm, k: (velocity_rad_s, 0.0, 0.0)
