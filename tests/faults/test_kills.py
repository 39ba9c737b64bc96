"""Some of the sessions that `python -m tests.faults.kills` ends at random moments."""

import pytest
from tests.faults.kills import run


@pytest.mark.realtime(resolves_s=1.0)
@pytest.mark.parametrize(
    ("rig", "kills"),
    [
        ("virtual", 1),
        *(pytest.param(rig, 2, marks=pytest.mark.slow) for rig in ("virtual", "canopen")),
    ],
)
def test_whatever_is_killed_nothing_is_lost_or_left(rig, kills):
    results = run(kills, 7, (rig,))
    assert not [result for result in results if result.bad]
