"""A session followed from the memory that its processes share."""

import numpy as np
import pytest
from tests.unit.rig.acquisition.exact_rig import Desk
from tests.unit.rig.acquisition.whole_session import RATE_HZ, VALUES, session

from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import Command, SimulatedClock, run_session
from rigidimeter.rig.acquisition.processes import (
    Estimator,
    LiveEstimate,
    RingSink,
    SampleReader,
    SessionMemory,
)
from rigidimeter.rig.console import Level, Observer, SessionPlan
from rigidimeter.rig.devices import SimulatedRig

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
        self.seen[sample.tick] = self.observer.facts_now()


def followed(shared, desk=None):
    sink = Followed(shared)
    session(desk, sink=sink, watch=sink.watch, state_changed=sink.state_changed)
    return sink.seen, sink.observer.facts_now()


def test_a_session_is_followed_to_its_end(shared):
    seen, last = followed(shared)
    # Two epochs of 50 ticks, each with 10 until the arm is still, 25 back and a rest of 30.
    assert seen[10].epoch.text == "epoch 1 of 2: OFF, prbs"
    assert seen[10].countdown_s == pytest.approx(1.0 - 10 / RATE_HZ)
    assert seen[10].session_left_s == pytest.approx(210 / RATE_HZ - 10 / RATE_HZ)
    assert (seen[55].epoch, seen[55].state_words) == (None, "the arm comes to rest")
    assert (seen[70].epoch, seen[70].countdown_words) == (None, "return")
    assert seen[70].countdown_s == pytest.approx(85 / RATE_HZ - 70 / RATE_HZ)
    assert (seen[90].epoch, seen[90].countdown_words) == (None, "rest")
    assert seen[90].countdown_s == pytest.approx(115 / RATE_HZ - 90 / RATE_HZ)
    assert seen[90].session_left_s == pytest.approx((25 + 105) / RATE_HZ)
    assert seen[120].epoch.place == 2
    assert [(c.good, c.bad, c.left) for c in seen[120].counts] == [(1, 0, 1)]
    assert [(c.good, c.bad, c.left) for c in last.counts] == [(2, 0, 0)]
    assert (last.state_words, last.session_left_s) == ("ended: success", 0.0)


def test_a_pause_and_the_repetition_after_it(shared):
    desk = Desk(orders={10: Command.PAUSE_NOW, 60: Command.RESUME})
    seen, last = followed(shared, desk)
    assert seen[50].state_words == "paused, the arm is still"
    assert seen[12].state_words == "paused, the arm comes to rest"
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
    late = Observer(PLAN, shared).facts_now()
    assert (late.counts, late.state_words) == (last.counts, last.state_words)


def test_live_estimates_are_remembered_for_one_epoch(shared):
    observer = Observer(PLAN, shared)
    for k in range(1, 101):
        shared.status.show_live(
            LiveEstimate(
                10 * k, 0, 0, 1, 0.0, 0.1 * k, 0.0045, 1e-5, 0.137, 1e-3, 1.7, 0.02, min(0.1 * k, 5)
            )
        )
        observer.facts_now()
        observer.facts_now()
    assert len(observer._history) == 100
    shared.status.show_live(LiveEstimate(2000, epoch=2))
    observer.facts_now()
    assert len(observer._history) == 1


EPOCH_S = 6.0


class Gain(SimulatedRig):
    """Its torque has another gain, and noise, in the epochs that `wrong` names."""

    def __init__(self, settings, wrong):
        subject = settings.subject["OFF"]
        super().__init__(settings.rig, subject, np.random.default_rng(1))
        self.wrong, self.gain, self.noise_nm = wrong, 1.0, 0.0
        self.noise = np.random.default_rng(2)

    def new(self, planned):
        self.gain, self.noise_nm = self.wrong.get(planned.number, (1.0, 0.0))
        return {}

    def read(self, elapsed_ticks=1):
        found = super().read(elapsed_ticks)
        noise_nm = self.noise_nm * float(self.noise.standard_normal())
        return found._replace(torque_nm=self.gain * found.torque_nm + noise_nm)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({}, ""),
        ({3: (0.5, 0.0)}, "epoch 3: J 0.00223 kg·m² is 0.5 times that of the epochs before"),
        ({1: (10.0, 0.0)}, "epoch 1: J 0.04"),  # outside the arms that were commissioned
        ({3: (1.0, 0.5)}, "epoch 3: the torque changed"),
    ],
)
def test_a_torque_that_was_wrong_through_an_epoch_is_named_at_its_end(wrong, words):
    """From the loop to the indicator; nothing stops, and the recording is complete."""
    rate = {"rate_hz": 250.0}
    settings = parse_settings(
        {
            "rig": {"tick_rate_hz": 250.0, "torque": rate, "motion": rate},
            "prbs": {"duration_s": EPOCH_S},
            "guard": {"reaction_time_s": 0.05},
            "protocol": {"blocks": [{"epochs": 3}], "rests_s": [1.0], "return_s": 0.6},
        }
    )
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, 1)
    memory = SessionMemory.create(250.0, 60.0)
    try:
        estimator, reader = Estimator(settings.online, 250.0), SampleReader(memory.samples)
        observer = Observer(SessionPlan(settings, protocol.epochs), memory)
        seen = []

        def look(time_s):
            memory.status.show_live(estimator.take(*reader.read()))
            sensor = next(
                indicator
                for indicator in observer.facts_now().indicators
                if indicator.name == "sensor"
            )
            seen.append((time_s, sensor.level, sensor.words))

        sink, rig = RingSink(memory, 250.0), Gain(settings, wrong)
        clock, before = SimulatedClock(), {"before_epoch": rig.new}
        result = run_session(protocol, settings, rig, clock, sink, progress=look, **before)
        look(99.0)
    finally:
        memory.unlink()
        memory.close()
    assert (result.outcome, result.epochs_good) == ("success", 3)
    cautions = [(time_s, text) for time_s, level, text in seen if level is Level.WATCH]
    assert bool(cautions) is bool(words)
    assert [text for text in observer.cautions if words not in text] == []
    if words:
        (epoch,) = wrong
        apart_s = EPOCH_S + 0.6 + 1.0  # with return and rest
        assert EPOCH_S * epoch < cautions[0][0] <= apart_s * epoch + 1.0
        assert words in cautions[0][1]
        assert words in observer.cautions[0]
