from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rigidimeter.analysis.recording import estimate
from rigidimeter.analysis.study import compare, compare_analysis, conditions
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Fit, Outcome, Score
from rigidimeter.core.settings import parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs


def fit(condition, B=0.1, K=1.0, J=0.004, outcome=None):
    return Fit("s", "1", condition, "bandlimited", outcome or Outcome(),
               value=np.array([J, B, K]))  # fmt: skip


def analysis(fits, scores=()):
    return Analysis("bandlimited", tuple(fits), tuple(fits), 0.004, tuple(scores))


@pytest.mark.parametrize("given", [None, ["a"], {"a": [1]}, analysis([])])
def test_what_cannot_be_compared_is_refused(given):
    with pytest.raises(UserError, match="compare takes a study folder, estimates"):
        compare(given, value="a")


def test_a_recording_or_a_folder_is_no_file_of_estimates(tmp_path):
    for path in (tmp_path, tmp_path / "elbow.csv"):
        with pytest.raises(UserError, match="neither a study folder nor a JSON file of estimates"):
            compare(path)


def test_a_table_needs_columns_of_different_names():
    table = pd.DataFrame({"a": [1.0, 2.0], "condition": ["X", "Y"]})
    for value in (None, [], 0):
        with pytest.raises(UserError, match="a table needs value="):
            compare(table, value=value)
    with pytest.raises(UserError, match="two columns with the name a"):
        compare(pd.concat([table, table], axis=1), value="a")


def test_off_is_the_reference_wherever_it_comes():
    assert conditions(analysis([fit("DBS"), fit("OFF"), fit("")])) == ("OFF", "DBS")


def test_excluded_epochs_are_counted_and_left_out():
    fits = [fit("OFF", K=k) for k in (2.0, 2.1, 2.2)] + [fit("DBS", K=k) for k in (1.0, 1.1, 1.2)]
    fits.append(fit("OFF", K=99.0, outcome=Outcome("excluded", "limit")))
    stiffness = compare_analysis(analysis(fits)).comparison("stiffness_nm_rad")
    assert stiffness.values == {"OFF": (2.0, 2.1, 2.2), "DBS": (1.0, 1.1, 1.2)}
    assert stiffness.excluded == {"OFF": 1, "DBS": 0}
    assert stiffness.test is not None
    assert stiffness.test.shift == pytest.approx(1.0)
    assert stiffness.test.z > 0


def test_too_few_epochs_give_summaries_and_a_reason():
    (inertia, *_) = compare_analysis(analysis([fit("OFF"), fit("DBS")])).comparisons
    assert inertia.test is None
    assert "needs 3 epochs" in inertia.remark
    assert inertia.summaries["OFF"].n == 1


def test_one_condition_gives_its_summary():
    scores = [Score("s", "1", "OFF", Outcome(), 0.4, 0.3, 8, 1.0)]
    found = compare_analysis(analysis([], scores)).comparisons
    assert [c.measure.name for c in found] == ["impulse_nm_s", "work_j"]
    assert found[0].remark == "only one condition was recorded"


def test_recordings_of_another_joint_are_a_finding():
    """J 20 % higher in one of two recordings."""
    joints = [JointDynamics(0.0045 * factor, 0.1368, 1.751) for factor in (1.0, 1.0, 1.2, 1.2)]
    batch = simulate_epochs(parse_settings({}), 4, joints=joints, conditions="OFF", seed=2)
    epochs = [replace(batch.epoch(i), source=f"day{i // 2}.csv") for i in range(4)]
    (found,) = estimate(epochs, "iv").across
    assert (found.name, found.level) == ("inertia_of_recordings", "caution")
    assert found.value == pytest.approx(20.0, abs=1.0)
    assert found.headline == "J of day1.csv is 20 % above that of day0.csv"
    assert estimate(epochs[:2], "iv").across == ()


def test_epochs_whose_stiffness_differs_are_named_in_the_pooled_fit():
    settings = parse_settings({"subject": {"OFF": {"voluntary_sd_nm": 0.02}}})
    factors = (0.7, 1.3, 0.8, 1.1)
    joints = [JointDynamics(0.0045, 0.1368, 1.751 * factor) for factor in factors]
    batch = simulate_epochs(settings, 4, joints=joints, conditions="OFF", seed=2)
    days = [replace(batch.epoch(i), source=f"/data/day-{i // 2}") for i in range(4)]
    analysis = estimate(days, "iv", settings=settings)
    (finding,) = (f for f in analysis.pooled[0].findings if f.name == "varying_between_epochs")
    assert finding.value == pytest.approx(60 / 0.975, rel=0.05)
    assert (finding.facts["symbol"], finding.facts["low_at"]) == ("K", "epoch 0 of day-0")
    assert finding.facts["high"] == pytest.approx(2.25, abs=0.05)
    # A joint is not the same twice: a number, and no warning unless the settings ask for one.
    assert finding.level == "note"
