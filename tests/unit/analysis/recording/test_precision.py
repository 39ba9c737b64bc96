"""How precise what a recording gives is, and how many epochs would make it better."""

import math

import numpy as np
import pytest

from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.recording import condition_precisions
from rigidimeter.analysis.statistics import precision_of
from rigidimeter.core.records import Analysis, Epoch, Fit, Outcome, Score
from rigidimeter.core.settings import Settings, parse_settings

K = "stiffness_nm_rad"
COUNTS, USUAL = Outcome(), Settings()


def fit(condition: str, stiffness: float, half: float = 0.1, *, outcome: Outcome = COUNTS):
    value = np.array([0.004, 0.1, stiffness])
    ends = {"low": value - half, "high": value + half, "se": np.full(3, half / 2)}
    return Fit("s", f"{stiffness}", condition, "iv", outcome, value=value, **ends)


def analysis(fits, pooled=(), scores=()) -> Analysis:
    return Analysis("iv", tuple(fits), tuple(fits), 0.004, tuple(scores), pooled=tuple(pooled))


def recording(*conditions: str, settings: Settings = USUAL) -> Recording:
    epochs = (Epoch("s", f"{k}", {}, condition=name) for k, name in enumerate(conditions))
    return Recording(tuple(epochs), (), settings, ())


def test_the_estimate_of_all_epochs_together_counts_where_there_is_one():
    found = analysis([fit("OFF", 1.0), fit("OFF", 1.2)], [fit("OFF", 1.05, 0.2)])
    one = condition_precisions(recording("OFF", "OFF"), found)["OFF"][K]
    assert (one.n, one.value) == (2, 1.05)
    assert (one.low, one.high, one.se) == pytest.approx((0.85, 1.25, 0.1))
    assert one.sd_percent == pytest.approx(100 * np.std([1.0, 1.2], ddof=1) / 1.1)


def test_without_it_the_mean_of_the_epochs_that_count():
    out = fit("OFF", 9.0, outcome=Outcome("excluded", "tremor"))
    found = analysis([fit("OFF", 1.0), fit("OFF", 1.2), out])
    one = condition_precisions(recording("OFF"), found)["OFF"][K]
    assert (one.n, one.value, one.se) == pytest.approx((2, 1.1, 0.1))
    assert one.high - one.value == pytest.approx(12.706 * 0.1, rel=1e-4)


def test_of_one_epoch_its_own_interval():
    one = condition_precisions(recording("OFF"), analysis([fit("OFF", 1.0)]))["OFF"][K]
    assert (one.n, one.low, one.high) == (1, 0.9, 1.1)
    assert math.isnan(one.sd_percent)


def test_an_estimate_that_does_not_count_gives_way_to_the_mean():
    refused = fit("OFF", 5.0, outcome=Outcome("excluded", "undecided"))
    found = analysis([fit("OFF", 1.0), fit("OFF", 1.2)], [refused])
    assert condition_precisions(recording("OFF"), found)["OFF"][K].value == pytest.approx(1.1)


def test_scores_are_means_over_epochs():
    scores = [Score("s", f"{k}", "DBS", Outcome(), 1.0 + k, 2.0 + k) for k in range(3)]
    found = condition_precisions(recording("DBS"), analysis([], scores=scores))["DBS"]
    assert [*found] == ["impulse_nm_s", "work_j"]
    assert found["work_j"].value == 3.0


def test_conditions_are_in_the_order_of_the_protocol_else_off_first():
    found = analysis([fit(name, 1.0) for name in ("C", "B", "OFF", "A")])
    read = recording("C", "B", "OFF", "A")
    assert [*condition_precisions(read, found)] == ["OFF", "C", "B", "A"]
    blocks = [{"task": "prbs", "condition": name, "epochs": 1} for name in ("A", "C")]
    subjects = {"A": {}, "C": {}}
    settings = parse_settings({"protocol": {"blocks": blocks}, "subject": subjects})
    read = recording("C", "B", "OFF", "A", settings=settings)
    assert [*condition_precisions(read, found)] == ["A", "C", "OFF", "B"]


def test_without_a_name_and_with_nothing_that_counts():
    assert [*condition_precisions(recording(""), analysis([fit("", 1.0)]))] == [""]
    out = fit("OFF", 1.0, outcome=Outcome("failed", "short"))
    assert condition_precisions(recording("OFF"), analysis([out])) == {}


@pytest.mark.parametrize("together", [(0.0, -1.0, 1.0, 0.5), (1.0, 0.0, 2.0, math.nan)])
def test_how_many_are_needed_is_not_known_of_zero_or_without_an_error(together):
    assert precision_of([1.0, 2.0], together).needed is None


def test_four_times_as_many_epochs_halve_the_interval():
    assert precision_of([1.0] * 10, (1.0, 0.9, 1.1, 0.1 / 1.959963984540054)).needed == 40
