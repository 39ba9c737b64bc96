"""A session followed from the memory that its processes share."""

import pytest
from tests.unit.acquisition.exact_rig import Desk
from tests.unit.acquisition.whole_session import RATE_HZ, VALUES, session

from rigidimeter.acquisition.processes.session_memory import SessionMemory
from rigidimeter.acquisition.processes.sink import RingSink
from rigidimeter.acquisition.processes.status_values import LiveEstimate
from rigidimeter.acquisition.run_states import Command
from rigidimeter.console import Observer, SessionPlan
from rigidimeter.experiment import plan
from rigidimeter.settings import parse_settings

SETTINGS = parse_settings(VALUES)
PLAN = SessionPlan(
    SETTINGS, plan(SETTINGS.protocol, SETTINGS.prbs, SETTINGS.sinusoid, 1).epochs, virtual=True
)


@pytest.fixture
def shared():
    shared = SessionMemory.create(RATE_HZ, 60.0)
    yield shared
    shared.unlink()
    shared.close()


class Followed(RingSink):
    """Has an observer look after every sample."""

    def __init__(self, shared):
        super().__init__(shared, RATE_HZ)
        self.observer, self.seen = Observer(PLAN, shared), {}

    def sample(self, sample):
        super().sample(sample)
        self.seen[sample.tick] = self.observer.look()


def followed(shared, desk=None):
    sink = Followed(shared)
    session(desk, sink=sink, watch=sink.watch, state_changed=sink.state_changed)
    return sink.seen, sink.observer.look()


def test_a_session_is_followed_to_its_end(shared):
    seen, last = followed(shared)
    # Two epochs of 50 ticks, each with a rest of 30: tick 10 is the 11th of the first epoch.
    assert seen[10].epoch.text == "epoch 1 of 2: OFF, prbs"
    assert seen[10].countdown_s == pytest.approx(1.0 - 10 / RATE_HZ)
    assert seen[10].session_left_s == pytest.approx(160 / RATE_HZ - 10 / RATE_HZ)
    assert (seen[60].epoch, seen[60].countdown_words) == (None, "rest")
    assert seen[60].countdown_s == pytest.approx(80 / RATE_HZ - 60 / RATE_HZ)
    assert seen[60].session_left_s == pytest.approx(100 / RATE_HZ)
    assert seen[90].epoch.place == 2
    assert [(c.good, c.bad, c.left) for c in seen[90].counts] == [(1, 0, 1)]
    assert [(c.good, c.bad, c.left) for c in last.counts] == [(2, 0, 0)]
    assert (last.state_words, last.session_left_s) == ("ended: success", 0.0)


def test_a_pause_and_the_repetition_after_it(shared):
    desk = Desk(orders={10: Command.PAUSE_NOW, 60: Command.RESUME})
    seen, last = followed(shared, desk)
    assert seen[50].state_words == "paused"
    assert seen[50].countdown_words == ""
    assert seen[50].next_epoch.again
    again = next(one for tick, one in seen.items() if tick > 60 and one.epoch is not None)
    assert again.epoch.text == "epoch 1 of 2, again: OFF, prbs"
    assert [(c.good, c.bad, c.left) for c in last.counts] == [(2, 1, 0)]


def test_what_the_guard_counts_is_shown(shared):
    seen, _ = followed(shared)
    energy = {tick: one.distances[-1].value for tick, one in seen.items()}
    assert energy[0] == 0.0
    assert energy[40] > 0.0


def test_a_second_observer_sees_the_same(shared):
    _, last = followed(shared)
    late = Observer(PLAN, shared).look()
    assert (late.counts, late.state_words) == (last.counts, last.state_words)


def test_live_estimates_are_remembered_for_one_epoch(shared):
    observer = Observer(PLAN, shared)
    for k in range(1, 101):
        shared.status.show_live(
            LiveEstimate(
                10 * k, 0, 0, 1, 0.0, 0.1 * k, 0.0045, 1e-5, 0.137, 1e-3, 1.7, 0.02, min(0.1 * k, 5)
            )
        )
        observer.look()
        observer.look()
    assert len(observer._history) == 100
    shared.status.show_live(LiveEstimate(2000, epoch=2))
    observer.look()
    assert len(observer._history) == 1
