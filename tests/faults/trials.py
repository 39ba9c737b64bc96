"""One session in which something goes wrong, and what it must come to.

What is true of every stop, whatever its cause, is asserted here once: the first cause is kept in
the result, the events and the record; nothing of the record is lost; the velocity only ever becomes
smaller, no faster than the limit (S1) or at once (S0); the arm itself comes to rest, within its
limits, and the drive has no power in the end.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from tests.faults.rigs import ASCII, SLACK_S, Bench, Wrong
from tests.lateness import PRESENT

from rigidimeter.core.session import SessionWriter, read_samples
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import NOTHING, Order, run_session
from rigidimeter.rig.guard import Cause, Reaction

AT_S = 0.25
"""A fault comes when the imposed motion is fastest, half a period after its start."""

AT_REST_RAD_S = 0.02

DRIVES_OWN = (Cause.DRIVE_FAULT, Cause.DRIVE_STATE, Cause.DRIVE_LOST, Cause.STALLED)


@dataclass
class Desk:
    """Orders and causes of an operator, by the number of the tick after the first."""

    orders: dict[int, Any] = field(default_factory=dict)
    causes: dict[int, Cause] = field(default_factory=dict)
    attended: bool = False
    tick: int = -1
    measured: float = math.nan

    def cause(self, now_s: float) -> int:
        self.tick += 1
        return int(self.causes.get(self.tick, 0))

    def order(self) -> Order:
        given = self.orders.pop(self.tick, NOTHING)
        return given if isinstance(given, Order) else Order(given)


class Tap:
    """Stands between loop and rig: acts before a given tick, notes when power was taken away."""

    origin_rad = 0.0

    def __init__(self, bench: Bench, acts: dict[int, Callable[[], None]]) -> None:
        self._bench, self._rig, self._acts = bench, bench.rig, dict(acts)
        self.ticks = 0
        self.acted_s: dict[int, float] = {}
        self.written: list[float] = []
        self.disabled_s = math.nan
        self.connect, self.configure = self._rig.connect, self._rig.configure
        self.enable, self.zero = self._rig.enable, self._rig.zero
        self.stop, self.close = self._rig.stop, self._rig.close

    @property
    def counts(self) -> Any:
        return self._rig.counts

    @property
    def powered(self) -> bool:
        return bool(self._rig.powered)

    def read(self, elapsed_ticks: int = 1) -> Any:
        for at in [at for at in self._acts if at <= self.ticks]:
            act = self._acts.pop(at)
            self.acted_s[at] = self._bench.clock.now_s()
            act()
        return self._rig.read(elapsed_ticks)

    def write(self, velocity_rad_s: float) -> float:
        self.ticks += 1
        if math.isnan(self.disabled_s):
            self.written.append(velocity_rad_s)
        return float(self._rig.write(velocity_rad_s))

    def disable(self) -> None:
        if math.isnan(self.disabled_s):
            self.disabled_s = self._bench.clock.now_s()
        self._rig.disable()


@dataclass
class Trial:
    """What came of it. Times are on the loop's clock; `fault_s` is when it went wrong."""

    bench: Bench
    result: Any
    error: BaseException | None
    events: list[dict[str, Any]]
    samples: dict[str, Any]
    trace: Any
    fault_s: float
    disabled_s: float
    powered: bool
    written: Any
    began_s: float

    @property
    def slack_s(self) -> float:
        """What scheduling may have added: nothing on a simulated clock."""
        if self.bench.virtual:
            return 1e-9
        return SLACK_S + PRESENT[0].worst_s(self.began_s)

    @property
    def tick_s(self) -> float:
        return 1.0 / self.bench.rate_hz

    @property
    def first(self) -> int:
        """The first row with a cause."""
        rows = np.flatnonzero(self.samples["cause"])
        assert rows.size, f"no cause was recorded; the session ended with {self.result}"
        return int(rows[0])

    @property
    def detected_s(self) -> float:
        """From the fault to the first row with a cause."""
        return float(self.samples["time_s"][self.first] - self.fault_s)

    @property
    def zero_s(self) -> float:
        """From the fault until the velocity sent is zero, for good."""
        moving = np.flatnonzero(self.samples["velocity_command_rad_s"])
        row = moving[-1] + 1 if moving.size else 0
        if row == len(self.samples["tick"]):  # it was not recorded as sent: then without power
            return self.disabled_s - self.fault_s
        return float(self.samples["time_s"][max(row, self.first)] - self.fault_s)

    @property
    def rest_s(self) -> float:
        """From the fault until the arm itself stands still, for good."""
        moving = np.abs(self.trace[:, 2]) > AT_REST_RAD_S
        assert not moving[-1], "the arm still moves"
        if not moving.any():
            return 0.0
        return max(float(self.trace[np.flatnonzero(moving)[-1] + 1, 0] - self.fault_s), 0.0)

    def of(self, kind: str) -> list[dict[str, Any]]:
        return [event for event in self.events if event["event"] == kind]


def run(
    bench: Bench,
    folder: Path,
    wrong: Wrong | Callable[[], None] | None = None,
    *,
    at_s: float = AT_S,
    then: dict[float, Callable[[], None]] | None = None,
    desk: Desk | None = None,
    task: str = "sinusoid",
    epochs: int = 1,
    sink: Callable[[Any], Any] = lambda writer: writer,
    **options: Any,
) -> Trial:
    """Run a session, of one epoch as a rule, in which something goes wrong after `at_s`."""
    settings = bench.settings
    blocks = [{"task": task, "epochs": epochs}]
    protocol = plan(
        settings.protocol.model_validate({**settings.protocol.model_dump(), "blocks": blocks}),
        settings.prbs,
        settings.sinusoid,
        1,
    )
    at = round(at_s * bench.rate_hz)
    acts: dict[int, Callable[[], None]] = {}
    if wrong is not None:
        acts[at] = (lambda: bench.misbehave(wrong)) if isinstance(wrong, Wrong) else wrong
    for later_s, act in (then or {}).items():
        acts[round(later_s * bench.rate_hz)] = act
    tap = Tap(bench, acts)
    writer = SessionWriter(folder, settings, [], {"session": 1}, virtual=bench.virtual)
    result, error = None, None
    began_s = time.monotonic()
    try:
        result = run_session(
            protocol, settings, tap, bench.clock, sink(writer), supervision=desk, **options
        )
    except (Exception, KeyboardInterrupt) as caught:  # an interrupt may come while it stops
        error = caught
    bench.settle()
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    samples = read_samples(folder / "samples.arrows")
    start_s = samples["tick"][0] / bench.rate_hz if len(samples["tick"]) else 0.0
    fault_s = tap.acted_s.get(at, start_s + at / bench.rate_hz)
    return Trial(
        bench,
        result,
        error,
        events,
        samples,
        bench.trace(),
        fault_s,
        tap.disabled_s,
        bench.powered,
        np.array(tap.written),
        began_s,
    )


def assert_stopped(
    trial: Trial,
    cause: Cause | tuple[Cause, ...],
    within_s: float,
    *,
    reaction: Reaction = Reaction.RAMP,
    drive_stops_itself: float = 0.0,
    more_s: float = 0.0,
) -> None:
    """Assert all that a stop must be.

    Parameters
    ----------
    trial : Trial
    cause : Cause or tuple of Cause
        What must be named; one of several where the wire decides which is seen first.
    within_s : float
        From the fault to the first row with a cause, without slack.
    reaction : Reaction
        RAMP and HOLD bring the velocity to zero within the acceleration limit, CUT at once.
    drive_stops_itself : float
        Where commands no longer reach the drive: how long its own watchdog may take.
    more_s : float
        What an arm that is faster than commanded needs in addition.
    """
    named = Cause(int(trial.samples["cause"][trial.first]))
    assert named in (cause if isinstance(cause, tuple) else (cause,)), named.name
    assert_recorded(trial, named)
    assert trial.detected_s <= within_s + trial.slack_s, (trial.detected_s, within_s)
    assert_came_to_rest(trial, reaction, drive_stops_itself, more_s)


def assert_recorded(trial: Trial, cause: Cause) -> None:
    """Assert that cause and reason stand everywhere, and that no tick is missing."""
    assert trial.error is None, trial.error
    assert trial.result.cause is cause
    assert trial.result.outcome == "fail"
    assert cause.sentence in trial.result.reason
    (epoch,) = trial.of("epoch_ended")
    assert (epoch["outcome"], cause.sentence in epoch["reason"]) == ("fail", True), epoch
    last = trial.events[-1]
    assert last["event"] == "session_ended"
    assert (last["outcome"], cause.sentence in last["reason"]) == ("fail", True), last
    causes = trial.samples["cause"]
    assert set(causes[: trial.first]) <= {0}
    assert set(causes[trial.first :]) == {int(cause)}
    assert_whole(trial)


def assert_whole(trial: Trial) -> None:
    """Assert that every tick is there, but for those that were late, which say so."""
    tick, lateness_s = trial.samples["tick"], trial.samples["lateness_s"]
    left_out = np.diff(tick) - 1
    late = np.where(lateness_s >= trial.tick_s, (lateness_s / trial.tick_s).astype(int), 0)[1:]
    np.testing.assert_array_equal(left_out, late)
    ended = trial.of("epoch_ended")
    if all("missed_ticks" in event for event in ended):  # an exception leaves no time to count
        in_epoch = trial.samples["epoch"] > 0
        counted = sum(event["missed_ticks"] for event in ended)
        assert left_out[in_epoch[1:]].sum() + late_at_first(trial) == counted


def late_at_first(trial: Trial) -> int:
    """Return how many ticks were left out before the first row of all."""
    lateness_s = float(trial.samples["lateness_s"][0])
    return int(lateness_s / trial.tick_s) if lateness_s >= trial.tick_s else 0


def assert_came_to_rest(
    trial: Trial,
    reaction: Reaction = Reaction.RAMP,
    drive_stops_itself: float = 0.0,
    more_s: float = 0.0,
) -> None:
    """Assert that the arm stood still in time, never faster or farther than before allowed."""
    guard = trial.bench.settings.guard
    limit_rad_s2 = math.radians(guard.acceleration_limit_deg_s2)
    sent = trial.samples["velocity_command_rad_s"]
    before = abs(float(sent[max(trial.first - 1, 0)]))
    ramp_s = 0.0 if reaction is Reaction.CUT else before / limit_rad_s2
    # The guard changes the velocity by one tick's worth a step, also where a step covers two ticks.
    ramp_s *= int(np.diff(trial.samples["tick"][trial.first :]).max(initial=1))
    ticks_s = 2 * trial.tick_s
    if trial.bench.name == ASCII:
        ticks_s += 2 * trial.tick_s  # a command that meets a busy line waits for the next tick
    brakes_s = ramp_s + ticks_s + trial.slack_s
    if not drive_stops_itself:
        assert trial.zero_s <= trial.detected_s + brakes_s, (trial.zero_s, trial.detected_s)
        after = np.abs(np.concatenate([[before], sent[trial.first :]]))
        assert np.all(np.diff(after) <= 1e-3), "the velocity grew after the cause"
        # Where the drive has a fault, or has stopped meanwhile, zero is sent at once: it brakes by
        # its own ramp.
        ours = trial.samples["cause"][trial.first] not in DRIVES_OWN
        if reaction is not Reaction.CUT and ours and trial.bench.name != ASCII:
            elapsed = np.diff(trial.samples["tick"][trial.first - 1 :])
            change = limit_rad_s2 * trial.tick_s * elapsed
            outward = trial.samples["limited"][trial.first :] == 3
            assert np.all((-np.diff(after) <= change * 1.01 + 1e-3) | outward)
    settled_s = trial.detected_s + brakes_s + guard.reaction_time_s + trial.slack_s
    assert trial.rest_s <= settled_s + drive_stops_itself + more_s, (trial.rest_s, settled_s)
    assert not trial.powered
    assert trial.disabled_s == trial.disabled_s  # power was taken away by software as well
    after_fault = trial.trace[:, 0] >= trial.fault_s
    farthest = np.abs(trial.trace[after_fault, 1]).max()
    assert farthest <= math.radians(guard.position_limit_deg)
