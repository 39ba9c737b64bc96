"""The reaction to each cause, as the hazard table has it."""

import pytest

from rigidimeter.rig.guard import REACTIONS, Cause, Reaction

HOLD = {Cause.TORQUE_HIGH, Cause.POWER_HIGH, Cause.HELD_AT_LIMIT, Cause.TORQUE_WILD}
CUT = {Cause.EMERGENCY_STOP, Cause.OPERATOR_HALT}


def test_a_later_reaction_is_a_stronger_one():
    assert list(Reaction) == [0, 1, 2, 3]
    assert [r.name for r in Reaction] == ["NONE", "HOLD", "RAMP", "CUT"]


@pytest.mark.parametrize("cause", Cause)
def test_the_reaction_to_each_cause(cause):
    if cause is Cause.NONE:
        expected = Reaction.NONE
    elif cause in HOLD:
        expected = Reaction.HOLD
    elif cause in CUT:
        expected = Reaction.CUT
    else:
        expected = Reaction.RAMP
    assert cause.reaction is expected
    assert REACTIONS[cause] == expected
    assert type(REACTIONS[cause]) is int


def test_numbers_are_what_records_hold():
    # A recording of an earlier version must be read the same: numbers are only ever added.
    assert [int(cause) for cause in Cause] == list(range(39))
    assert len(REACTIONS) == 39
    named = (Cause.TORQUE_NOT_FINITE, Cause.NOT_FOLLOWING, Cause.EMERGENCY_STOP, Cause.SIGNAL)
    assert named == (1, 12, 21, 29)


@pytest.mark.parametrize("cause", Cause)
def test_every_cause_has_words_of_its_own(cause):
    assert cause.sentence.strip() == cause.sentence
    assert len({other.sentence for other in Cause}) == len(Cause)
