"""The mixed model against closed forms and invariances; R is asked in `tests/reference`."""

import numpy as np
import pytest

from rigidimeter.analysis.statistics import (
    contrast,
    difference,
    evaluate,
    fit_mixed,
    joint_test,
    nested,
    products,
)


def balanced(seed: int, examiners: int = 4, days: int = 6, spread: float = 0.6):
    """Every examiner rates every day of both conditions."""
    rng = np.random.default_rng(seed)
    offsets = spread * rng.standard_normal(examiners)
    scores = 2 - 0.4 * np.arange(2)[:, None, None] + offsets + np.zeros((2, days, examiners))
    scores += 0.3 * rng.standard_normal(scores.shape)
    c, _, e = np.indices(scores.shape)
    conditions = [("OFF", "DBS")[k] for k in c.ravel()]
    return scores, conditions, [f"e{k}" for k in e.ravel()]


def test_balanced_data_have_the_closed_form_of_the_analysis_of_variance() -> None:
    scores, conditions, examiners = balanced(1)
    n, per_examiner = scores.size, scores.size // 4
    means, by_examiner = scores.mean(axis=(1, 2)), scores.mean(axis=(0, 1))
    between = per_examiner * np.var(by_examiner, ddof=1)
    rest = scores - means[:, None, None] - by_examiner + scores.mean()
    error = np.sum(rest**2) / (n - 2 - 3)
    fit = fit_mixed(scores.ravel(), conditions, {"examiner": examiners})
    assert fit.means == pytest.approx(means, rel=1e-12)
    assert fit.variance_residual == pytest.approx(error, rel=1e-10)
    assert fit.variances["examiner"] == pytest.approx((between - error) / per_examiner, rel=1e-10)
    shrunk = (1 - error / between) * (by_examiner - scores.mean())
    assert list(fit.offsets["examiner"].values()) == pytest.approx(shrunk, rel=1e-9)
    test = difference(fit, "OFF", "DBS")
    assert test.se == pytest.approx(np.sqrt(2 * error / (n / 2)), rel=1e-10)
    # Within-examiner contrasts have the degrees of freedom of the error, whatever the method.
    assert test.df_satterthwaite == pytest.approx(n - 2 - 3, rel=1e-9)
    assert test.df_kenward_roger == pytest.approx(n - 2 - 3, rel=1e-9)
    assert test.df_residual == n - 2


def test_the_mean_of_one_condition_has_few_degrees_of_freedom() -> None:
    """A mean carries the examiners' spread; with 4 examiners its ν is near 3, not n − 2."""
    scores, conditions, examiners = balanced(1)
    fit = fit_mixed(scores.ravel(), conditions, {"examiner": examiners})
    assert 3 < contrast(fit, [1.0, 0.0]).df_satterthwaite < 4


def test_gradient_and_hessian_are_those_of_the_deviance() -> None:
    rng = np.random.default_rng(2)
    x = np.eye(3)[rng.integers(0, 3, 40)]
    z = [np.eye(5)[rng.integers(0, 5, 40)], np.eye(7)[rng.integers(0, 7, 40)]]
    data = products(rng.standard_normal(40), x, z)
    here = np.array([0.3, 0.8])
    point = evaluate(data, here)
    for k, step in enumerate(1e-5 * np.eye(2)):
        up, down = (evaluate(data, here + s) for s in (step, -step))
        assert point.gradient[k] == pytest.approx((up.deviance - down.deviance) / 2e-5, rel=1e-6)
        assert point.hessian[k] == pytest.approx((up.gradient - down.gradient) / 2e-5, rel=1e-6)


def test_equal_examiners_end_at_the_boundary_with_the_ordinary_t_test() -> None:
    scores, conditions, examiners = balanced(6, spread=0.0)
    scores -= scores.mean(axis=(0, 1))  # the examiners' means are now exactly equal
    fit = fit_mixed(scores.ravel(), conditions, {"examiner": examiners})
    assert fit.at_zero == ("examiner",)
    assert fit.variances["examiner"] == 0
    assert set(fit.offsets["examiner"].values()) == {0.0}
    np.testing.assert_array_equal(fit.corrected, scores.ravel())
    off, dbs = scores[0].ravel(), scores[1].ravel()
    pooled = (off.var(ddof=1) + dbs.var(ddof=1)) / 2
    test = difference(fit, "OFF", "DBS")
    assert test.f == pytest.approx((off.mean() - dbs.mean()) ** 2 / (2 * pooled / off.size))
    assert test.df_satterthwaite == pytest.approx(test.df_residual)


def test_a_corrected_score_is_the_score_less_its_offset() -> None:
    scores, conditions, examiners = balanced(7)
    fit = fit_mixed(scores.ravel(), conditions, {"examiner": examiners})
    expected = [
        s - fit.offsets["examiner"][e] for s, e in zip(scores.ravel(), examiners, strict=True)
    ]
    assert fit.corrected == pytest.approx(expected, rel=1e-14)


def test_scale_and_shift_of_the_scores_change_nothing_else() -> None:
    scores, conditions, examiners = balanced(8)
    one = difference(fit_mixed(scores.ravel(), conditions, {"e": examiners}), "OFF", "DBS")
    other = fit_mixed(1000 + 7 * scores.ravel(), conditions, {"e": examiners})
    two = difference(other, "OFF", "DBS")
    assert two.estimate == pytest.approx(7 * one.estimate, rel=1e-9)
    assert two.p_satterthwaite == pytest.approx(one.p_satterthwaite, rel=1e-7)


def test_days_of_different_subjects_are_different_days() -> None:
    assert nested(["a", "b"], ["1", "1"]) == ["a/1", "b/1"]


def test_one_joint_test_of_three_conditions() -> None:
    rng = np.random.default_rng(9)
    conditions = ["OFF", "LOW", "HIGH"] * 8
    examiners = [f"e{k % 4}" for k in range(24)]
    fit = fit_mixed(rng.standard_normal(24), conditions, {"examiner": examiners})
    joint = joint_test(fit)
    assert joint.df_numerator == 2
    turned = joint_test(fit, [[1.0, 0.0, -1.0], [0.0, 2.0, -2.0]])  # the same hypothesis
    assert turned.f == pytest.approx(joint.f)
    assert turned.df_satterthwaite == pytest.approx(joint.df_satterthwaite)
    assert turned.p_kenward_roger == pytest.approx(joint.p_kenward_roger)


def test_one_condition_is_fitted_and_has_nothing_to_compare() -> None:
    fit = fit_mixed([1.0, 2.0, 2.5, 1.5], ["OFF"] * 4, {"examiner": ["a", "a", "b", "b"]})
    assert fit.means == pytest.approx([1.75])
    with pytest.raises(ValueError, match="independent and not zero"):
        joint_test(fit)


@pytest.mark.parametrize(
    ("examiners", "reason"),
    [
        (["a"] * 6, "only one, a"),
        (["a"] * 3 + ["b"] * 3, "goes with the condition"),
        (list("abcdef"), "too few scores"),
    ],
)
def test_a_grouping_that_cannot_be_told_is_left_out_and_said(
    examiners: list[str], reason: str
) -> None:
    conditions = ["OFF"] * 3 + ["DBS"] * 3
    fit = fit_mixed([1.0, 2.0, 2.5, 0.5, 1.0, 2.5], conditions, {"examiner": examiners})
    assert reason in fit.inseparable["examiner"]
    assert fit.variances["examiner"] == 0
    test = difference(fit, "OFF", "DBS")
    assert test.df_satterthwaite == pytest.approx(4)
    assert test.p_kenward_roger == pytest.approx(test.p_residual)


def test_two_groupings_that_are_one_cannot_be_told_apart() -> None:
    scores, conditions, examiners = balanced(10)
    fit = fit_mixed(scores.ravel(), conditions, {"examiner": examiners, "desk": examiners})
    assert set(fit.inseparable) == {"desk"}


def test_an_examiner_with_one_score_is_allowed() -> None:
    scores, conditions, examiners = balanced(11)
    fit = fit_mixed([*scores.ravel(), 3.0], [*conditions, "OFF"], {"e": [*examiners, "once"]})
    assert 0 < fit.offsets["e"]["once"] < 3.0 - fit.means[0]


@pytest.mark.parametrize(
    ("scores", "conditions", "message"),
    [
        ([1.0, np.nan, 2.0], ["a", "b", "b"], "finite"),
        ([1.0, 2.0], ["a", "b"], "2 scores cannot give 2 means"),
        ([1.0, 2.0, 1.0], ["a", "b"], "2 labels for 3 scores"),
        ([1.0, 1.0, 2.0, 2.0], ["a", "a", "b", "b"], "do not vary beyond"),
    ],
)
def test_what_cannot_be_fitted_is_refused(scores, conditions, message) -> None:
    with pytest.raises(ValueError, match=message):
        fit_mixed(
            scores,
            conditions,
            {"examiner": ["x", "y"] * (len(scores) // 2) + ["x"] * (len(scores) % 2)},
        )


def test_weights_and_names_are_checked() -> None:
    scores, conditions, examiners = balanced(12)
    fit = fit_mixed(scores.ravel(), conditions, {"examiner": examiners})
    with pytest.raises(ValueError, match="no condition ON; known: OFF, DBS"):
        difference(fit, "OFF", "ON")
    with pytest.raises(ValueError, match="OFF twice"):
        difference(fit, "OFF", "OFF")
    with pytest.raises(ValueError, match="2 columns"):
        contrast(fit, [1.0, -1.0, 0.0])
    with pytest.raises(ValueError, match="independent"):
        joint_test(fit, [[1.0, -1.0], [2.0, -2.0]])
