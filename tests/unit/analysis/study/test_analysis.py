import math
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from rigidimeter.analysis.estimation import task_of
from rigidimeter.analysis.reading import Recording
from rigidimeter.analysis.study import compare, compare_analysis, conditions, estimate
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Analysis, Channel, Epoch, Fit, Outcome, Score
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.model import JointDynamics
from rigidimeter.virtual.batch import simulate_epochs


def fit(condition, B=0.1, K=1.0, J=0.004, outcome=None):
    return Fit("s", "1", condition, "bandlimited", outcome or Outcome(),
               value=np.array([J, B, K]))  # fmt: skip


def analysis(fits, scores=()):
    return Analysis("bandlimited", tuple(fits), tuple(fits), 0.004, tuple(scores))


def epochs_with_inertia(inertias, closed=None):
    """Exact broad-band motions of joints that differ in inertia alone."""
    t = np.arange(6000) / 300.0
    f = np.arange(0.2, 20.0, 0.35)
    w = 2 * np.pi * f
    made = []
    for k, J in enumerate(inertias):
        phase = np.random.default_rng(k).uniform(0, 2 * np.pi, f.size)
        angle = np.outer(w, t) + phase[:, None]
        A = 0.05 / (1 + f)
        x, v, a = A @ np.sin(angle), (A * w) @ np.cos(angle), -(A * w**2) @ np.sin(angle)
        channels = {
            "torque_nm": Channel("torque_nm", t, J * a + 0.14 * v + 1.7 * x),
            "angle_rad": Channel("angle_rad", t, x),
        }
        outcome = (closed or {}).get(k, Outcome())
        made.append(Epoch("s", str(k), channels, task="prbs", closed=outcome))
    return made


def test_a_recording_is_estimated_with_its_settings():
    epochs = tuple(epochs_with_inertia([0.004, 0.005]))
    settings = parse_settings({"estimation": {"band_high_closed_loop_hz": 12.0}})
    found = estimate(Recording(epochs, (), settings, ()), "bandlimited")
    assert found == estimate(epochs, "bandlimited", settings=settings)
    assert found.fits[0].band_hz == pytest.approx((0.1, 12.0))
    assert estimate(epochs, "bandlimited") == estimate(epochs, "bandlimited", settings=Settings())
    with pytest.raises(ValueError, match="method 'magic': there is no such method"):
        estimate(epochs, "magic")


@pytest.mark.parametrize("given", ["elbow.csv", None, ["elbow.csv"]])
def test_only_a_recording_or_epochs_are_estimated(given):
    with pytest.raises(UserError, match="takes a Recording or a list of its epochs"):
        estimate(given)


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


def test_the_second_stage_holds_the_median_inertia_of_the_included():
    epochs = epochs_with_inertia([0.004, 0.005, 0.009, 0.02], {3: Outcome("excluded", "limit")})
    found = estimate(epochs, settings=Settings())
    assert found.inertia_kg_m2 == pytest.approx(0.005, rel=1e-3)
    assert {f.inertia_kg_m2 for f in found.fixed_inertia} == {found.inertia_kg_m2}
    assert found.fixed_inertia[1].damping_nm_s_rad == pytest.approx(0.14, rel=1e-3)
    assert found.fixed_inertia[3].outcome.reason == "limit"


def test_without_an_included_epoch_there_is_no_second_stage():
    epochs = epochs_with_inertia([0.004], {0: Outcome("excluded", "limit")})
    found = estimate(epochs, settings=Settings())
    assert math.isnan(found.inertia_kg_m2)
    assert math.isnan(found.fixed_inertia[0].damping_nm_s_rad)
    assert found.fits[0].damping_nm_s_rad == pytest.approx(0.14, rel=1e-3)


def test_a_bad_epoch_does_not_stop_the_good_ones():
    good, bad = epochs_with_inertia([0.004, 0.004])
    t = np.arange(100) / 100.0
    bad = Epoch("s", "bad", {"torque_nm": Channel("torque_nm", t, t),
                             "angle_rad": Channel("angle_rad", t, t)})  # fmt: skip
    found = estimate([bad, good], settings=Settings())
    assert [f.outcome.kind for f in found.fits] == ["failed", "included"]


def test_the_task_is_told_from_the_motion_where_it_is_not_said():
    t = np.arange(2000) / 100.0
    sine = {"torque_nm": Channel("torque_nm", t, np.cos(2 * np.pi * t)),
            "angle_rad": Channel("angle_rad", t, np.sin(2 * np.pi * t))}  # fmt: skip
    assert task_of(Epoch("f", "1", sine), Settings()) == "sinusoid"
    assert task_of(Epoch("f", "1", sine, task="prbs"), Settings()) == "prbs"
    (broad,) = epochs_with_inertia([0.004])
    assert task_of(Epoch("f", "1", broad.channels), Settings()) == "prbs"


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
