"""Faults 11, 19 and 21 by the shared memory: console and recorder silent, a computer that slept."""

import pytest
from tests.faults.rigs import RIGS, bench
from tests.faults.trials import assert_stopped, run

from rigidimeter.rig.acquisition import NOTHING
from rigidimeter.rig.acquisition.processes import Role, SessionMemory, SharedSupervision
from rigidimeter.rig.guard import Cause


class SharedDesk:
    """The shared memory as the loop sees them, on the clock of the trial."""

    def __init__(self, made, **options):
        self.shared = SessionMemory.create(made.rate_hz, ring_s=100_000 / made.rate_hz)
        self.shared_status, self.ring = self.shared.status, self.shared.samples
        now_ns = lambda: 10**9 + round(1e9 * made.clock.now_s())  # noqa: E731
        self.shared_status._now_ns = now_ns
        self.suspended_s = 0.0
        self.supervision = SharedSupervision(
            self.shared,
            now_ns=now_ns,
            boot_ns=lambda: now_ns() + round(1e9 * self.suspended_s),
            **options,
        )
        self.attended = False
        self.alive = {Role.CONSOLE, Role.RECORDER}
        self.records = True

    def cause(self, now_s):
        for role in self.alive:
            self.shared_status.beat(role)
        if self.records:
            self.ring.recorded = self.ring.written
        return self.supervision.cause(now_s)

    @property
    def measured(self):
        return self.supervision.measured

    def order(self):
        return NOTHING

    def sink(self, writer):
        """Put every sample into the ring as well."""
        take = writer.sample

        def sample(row):
            take(row)
            self.ring.push(row)

        writer.sample = sample
        return writer

    def close(self):
        self.shared.unlink()
        self.shared.close()


@pytest.fixture
def shared_desk():
    made = []

    def make(*arguments, **options):
        made.append(SharedDesk(*arguments, **options))
        return made[-1]

    yield make
    for desk in made:
        desk.close()


@pytest.mark.parametrize("rig", RIGS)
def test_fault_11_suspended(rig, tmp_path, shared_desk, measured):
    """The computer sleeps for a minute: no tick is late, for the loop's clock slept too."""
    with bench(rig) as made:
        desk = shared_desk(made)
        trial = run(made, tmp_path / "s", lambda: setattr(desk, "suspended_s", 60.0), desk=desk)
        bound_s = 1 / made.rate_hz
        assert_stopped(trial, Cause.STALLED, bound_s)
        # The drive has stopped by itself meanwhile: nothing is set going again.
        assert trial.samples["velocity_command_rad_s"][trial.first] == 0.0
        measured(11, rig, "suspended for 60 s", trial, bound_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_19_console_lost(rig, tmp_path, shared_desk, measured):
    with bench(rig) as made:
        desk = shared_desk(made, console_lost_s=0.2)
        trial = run(made, tmp_path / "s", lambda: desk.alive.discard(Role.CONSOLE), desk=desk)
        bound_s = 0.2 + 1 / made.rate_hz
        assert_stopped(trial, Cause.CONSOLE_LOST, bound_s)
        measured(19, rig, "heartbeat limit 0.2 s", trial, bound_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_21_recorder_hangs(rig, tmp_path, shared_desk, measured):
    with bench(rig) as made:
        desk = shared_desk(made, recorder_lost_s=0.2)
        trial = run(made, tmp_path / "s", lambda: desk.alive.discard(Role.RECORDER), desk=desk)
        bound_s = 0.2 + 1 / made.rate_hz
        assert_stopped(trial, Cause.RECORDER_LOST, bound_s)
        measured(21, rig, "recorder silent, limit 0.2 s", trial, bound_s)


@pytest.mark.parametrize("rig", RIGS)
def test_fault_21_record_overflows(rig, tmp_path, shared_desk, measured):
    with bench(rig) as made:
        most = round(0.2 * made.rate_hz)
        desk = shared_desk(made, max_lag=most)
        trial = run(
            made,
            tmp_path / "s",
            lambda: setattr(desk, "records", False),
            desk=desk,
            sink=desk.sink,
        )
        bound_s = (most + 2) / made.rate_hz
        assert_stopped(trial, Cause.RECORD_OVERFLOW, bound_s)
        measured(21, rig, f"{most} samples wait", trial, bound_s)
