"""Order, labels, rests and counts of a session."""

import numpy as np
import pytest

from rigidimeter.core.settings import (
    BlockSettings,
    PrbsSettings,
    ProtocolSettings,
    SinusoidSettings,
)
from rigidimeter.planning import draw_rests_s, plan, rest_generator

BLOCKS = ProtocolSettings(
    blocks=[
        BlockSettings(task="prbs", condition="OFF", epochs=2),
        BlockSettings(task="sinusoid", condition="OFF", epochs=1),
        BlockSettings(task="prbs", condition="DBS", epochs=1),
        BlockSettings(task="prbs", condition="OFF", epochs=1),
    ],
)
PRBS, SINUSOID = PrbsSettings(duration_s=20.0), SinusoidSettings(duration_s=12.0)


def test_one_rest_to_choose_from_gives_the_total_in_closed_form() -> None:
    """A return of 3 s, and then the rest."""
    fixed = BLOCKS.model_copy(update={"rests_s": [10.0], "return_s": 3.0})
    assert plan(fixed, PRBS, SINUSOID, 1).total_s == 4 * (20 + 3 + 10) + 1 * (12 + 3 + 10)


def test_blocks_in_order_and_labels_over_the_session() -> None:
    session = plan(BLOCKS, PRBS, SINUSOID, 7)
    assert session.seed == 7
    assert [epoch.number for epoch in session.epochs] == [1, 2, 3, 4, 5]
    assert [epoch.label for epoch in session.epochs] == ["1", "2", "3", "4", "5"]
    assert [(epoch.task, epoch.condition) for epoch in session.epochs] == [
        ("prbs", "OFF"),
        ("prbs", "OFF"),
        ("sinusoid", "OFF"),
        ("prbs", "DBS"),
        ("prbs", "OFF"),
    ]
    assert [epoch.duration_s for epoch in session.epochs] == [20, 20, 12, 20, 20]
    assert session.counts == {("prbs", "OFF"): 3, ("sinusoid", "OFF"): 1, ("prbs", "DBS"): 1}


def test_the_seed_decides_the_rests() -> None:
    many = ProtocolSettings(blocks=[BlockSettings(epochs=200)])
    first, again, other = (plan(many, PRBS, SINUSOID, seed) for seed in (3, 3, 4))
    assert first == again
    rests = [[epoch.rest_s for epoch in session.epochs] for session in (first, other)]
    assert rests[0] != rests[1]
    assert set(rests[0]) == {10.0, 20.0}


def test_rests_are_drawn_evenly() -> None:
    rests = draw_rests_s([10.0, 20.0], 10_000, np.random.default_rng(5))
    # 10 000 fair draws: five standard deviations are 250
    assert abs(rests.count(10.0) - 5000) < 250


def test_rests_come_from_a_stream_of_their_own() -> None:
    own, plain = rest_generator(1), np.random.default_rng(1)
    assert own.integers(2**62) != plain.integers(2**62)


def test_a_negative_seed_is_refused() -> None:
    with pytest.raises(ValueError, match="negative"):
        rest_generator(-1)
