"""The rule that the table of scenarios is judged by."""

from __future__ import annotations

import numpy as np
import pytest
from benchmarks.scenarios.rule import row


def recording(error: float = 0.0, half_width: float = 0.05, doubts=(), pooled_doubts=()) -> dict:
    truth = [1.0, 2.0, 4.0]

    def fit(said) -> dict:
        return {
            "value": [x * (1 + error) for x in truth],
            "low": [x * (1 + error - half_width) for x in truth],
            "high": [x * (1 + error + half_width) for x in truth],
            "doubts": list(said),
        }

    return {"truth": [truth] * 4, "fits": [fit(doubts)] * 4, "pooled": [fit(pooled_doubts)]}


@pytest.mark.parametrize(
    ("one", "breaks"),
    [
        (recording(), ""),
        (recording(doubts=["tremor"]), "false alarm"),
        (recording(error=0.2, half_width=0.3), "silent, off"),
        (recording(error=0.02, half_width=0.01), "silent, overconfident"),
        (recording(error=0.2, doubts=["coherence"]), "misnamed"),
        (recording(error=0.2, pooled_doubts=["tremor_line"]), ""),
    ],
)
def test_a_wrong_answer_needs_the_right_finding_and_a_right_one_none(one, breaks: str) -> None:
    assert row([one] * 20, ["tremor"]).breaks == breaks


def test_shares_that_chance_may_give_break_nothing() -> None:
    """Binomial: of 20, 3 flags at 5 % come by chance in 8 %, 4 in 2 %; 16 right at 90 % in 13 %."""
    good, doubted = recording(), recording(doubts=["tremor"])
    assert row([good] * 17 + [doubted] * 3, ["tremor"]).breaks == ""
    assert row([good] * 16 + [doubted] * 4, ["tremor"]).breaks == "false alarm"
    wrong, said = recording(error=0.2), recording(error=0.2, doubts=["tremor"])
    assert row([said] * 16 + [wrong] * 4, ["tremor"]).breaks == ""
    assert row([said] * 15 + [wrong] * 5, ["tremor"]).breaks == "silent, off"
    missed = recording(error=0.02, half_width=0.01)
    assert row([good] * 2 + [missed], []).breaks == ""
    assert row([good] * 13 + [missed] * 7, []).breaks == "silent, overconfident"


def test_of_many_the_share_itself_decides() -> None:
    good, doubted = recording(), recording(doubts=["tremor"])
    assert row([good] * 950 + [doubted] * 50, []).breaks == ""
    assert row([good] * 930 + [doubted] * 70, []).breaks == "false alarm"


def test_to_say_that_a_joint_changed_is_no_false_alarm() -> None:
    said = recording(doubts=["varying_stiffness"])
    assert row([said] * 20, ["varying"]).breaks == "false alarm"
    assert row([said] * 20, ["varying"], other_model=True).breaks == ""
    also = recording(doubts=["varying_stiffness", "lack_of_fit"])
    assert row([also] * 20, ["varying"], other_model=True).breaks == ""
    both = recording(doubts=["varying_stiffness", "saturation"])
    assert row([both] * 20, ["varying"], other_model=True).breaks == "false alarm"


def test_numbers_of_a_row() -> None:
    found = row([recording(error=0.1), recording(error=-0.02, doubts=["coherence"])], [])
    assert np.allclose(found.epochs.bias, 0.04)
    assert np.allclose(found.epochs.scatter, 0.06)
    assert np.allclose(found.epochs.coverage, 0.5)
    assert np.allclose(found.pooled.bias, 0.04)
    assert (found.doubted_epochs, found.doubted) == (0.5, 0.5)
    assert found.shares == {"coherence": 0.5}
    assert found.recordings == 2


def test_epochs_without_numbers_are_left_out() -> None:
    failed = recording()
    for fit in (*failed["fits"], *failed["pooled"]):
        fit["value"] = fit["low"] = fit["high"] = [None] * 3
    assert np.allclose(row([failed, recording()], []).epochs.bias, 0.0)
    assert np.isnan(row([failed], []).epochs.bias).all()
