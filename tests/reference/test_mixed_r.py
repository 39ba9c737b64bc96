"""The mixed model against R (lme4, lmerTest, pbkrtest); scripts lie beside the numbers."""

import csv
import itertools
import math
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.shared_files import SHARED, skip_without

from rigidimeter.analysis.statistics import (
    Mixed,
    difference,
    fit_mixed,
    joint_test,
    nested,
    ranksum,
)

OURS = Path(__file__).parent / "mixed"
RANDOM = {
    "unbalanced": ("examiner",),
    "three": ("examiner",),
    "nested": ("subject", "subject/day"),
    "no_days": ("subject", "subject/day"),
    "crossed": ("examiner", "subject"),
    "days": ("examiner", "day"),
    "days_of_both": ("examiner", "day", "day/condition"),
}
TESTS = (
    "estimate", "se", "p_residual", "df_satterthwaite", "p_satterthwaite", "f_kenward_roger",
    "df_kenward_roger", "p_kenward_roger",
)  # fmt: skip


def rows(path: Path) -> list[dict[str, str]]:
    if not path.is_file():
        skip_without()
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def reference(path: Path, dataset: str) -> dict[str, float]:
    return {r["quantity"]: float(r["value"]) for r in rows(path) if r["dataset"] == dataset}


def ours(fit: Mixed) -> dict[str, float]:
    """Return the numbers of a fit under the names of our own R script."""
    joint = joint_test(fit)
    found = {f"mean_{name}": mean for name, mean in zip(fit.conditions, fit.means, strict=True)}
    found |= {f"variance_{name}": variance for name, variance in fit.variances.items()}
    for name, offsets in fit.offsets.items():
        found |= {f"offset_{name}_{label}": offset for label, offset in offsets.items()}
    for first, second in itertools.combinations(fit.conditions, 2):
        test = difference(fit, first, second)
        found |= {f"{key}_{first}-{second}": getattr(test, key) for key in TESTS}
    return found | {
        "variance_Residual": fit.variance_residual,
        "deviance": fit.deviance,
        "joint_f": joint.f,
        "joint_df_satterthwaite": joint.df_satterthwaite,
        "joint_p_satterthwaite": joint.p_satterthwaite,
        "joint_f_kenward_roger": joint.f_kenward_roger,
        "joint_df_kenward_roger": joint.df_kenward_roger,
    }


@pytest.mark.parametrize("dataset", ["balanced", "singular"])
def test_the_paper_s_design_agrees_with_r(dataset: str) -> None:
    folder = SHARED / "reference" / "lme"
    table = rows(folder / f"mupdrs_{dataset}.csv")
    scores = [float(row["score"]) for row in table]
    conditions = [row["condition"] for row in table]
    examiners = {"examiner": [row["examiner"] for row in table]}
    fit = fit_mixed(scores, conditions, examiners)
    test = difference(fit, "DBS", "OFF")
    cells = joint_test(fit, np.eye(2))
    off = np.array(conditions) == "OFF"
    corrected = ranksum(fit.corrected[off], fit.corrected[~off])
    found = {
        "beta_off": fit.means[0],
        "beta_dbs": fit.means[1],
        "se_off": math.sqrt(fit.covariance[0, 0]),
        "se_dbs": math.sqrt(fit.covariance[1, 1]),
        "diff_dbs_minus_off": test.estimate,
        "se_diff": test.se,
        "var_examiner": fit.variances["examiner"],
        "var_resid": fit.variance_residual,
        **{f"blup_{name}": offset for name, offset in fit.offsets["examiner"].items()},
        "reml_deviance": fit.deviance,
        "loglik_reml": -fit.deviance / 2,
        "satt_F": test.f,
        "satt_df2": test.df_satterthwaite,
        "satt_p": test.p_satterthwaite,
        "kr_F": test.f_kenward_roger,
        "kr_df2": test.df_kenward_roger,
        "kr_p": test.p_kenward_roger,
        "wald_F": test.f,
        "resid_df2": test.df_residual,
        "resid_p": test.p_residual,
        "wald_z_p": math.erfc(math.sqrt(test.f / 2)),
        "cellmeans_joint_F": cells.f,
        "cellmeans_joint_df1": cells.df_numerator,
        "cellmeans_joint_p": cells.p_satterthwaite,
        "is_singular": float(fit.at_zero == ("examiner",)),
        "corr_wilcox_W": corrected.u,
        "corr_wilcox_p_cc": corrected.p,
        "corr_wilcox_p_nocc": corrected.p_uncorrected,
    }
    expected = reference(folder / "r_reference.csv", dataset)
    expected = {name: value for name, value in expected.items() if not name.startswith("lrt_")}
    assert set(found) == set(expected)  # every number that R gave but the likelihood-ratio test
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-7, abs=1e-12), name


@pytest.mark.parametrize("dataset", RANDOM)
def test_unbalanced_nested_and_crossed_models_agree_with_r(dataset: str) -> None:
    expected = reference(OURS / "r_reference.csv", dataset)
    found = ours(fit_of(dataset))
    assert set(found) == set(expected)
    for name, value in expected.items():
        assert found[name] == pytest.approx(value, rel=1e-6, abs=1e-10), name


def fit_of(dataset: str) -> Mixed:
    table = [row for row in rows(OURS / "scores.csv") if row["dataset"] == dataset]
    columns = {key: [row[key] for row in table] for key in table[0]}
    columns["subject/day"] = nested(columns["subject"], columns["day"])
    columns["day/condition"] = nested(columns["day"], columns["condition"])
    scores = [float(score) for score in columns["score"]]
    groups = {name: columns[name] for name in RANDOM[dataset]}
    return fit_mixed(scores, columns["condition"], groups)


def test_the_boundary_is_named() -> None:
    assert fit_of("no_days").at_zero == ("subject/day",)


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("Rscript") is None, reason="R is not installed")
def test_r_itself_still_gives_these_numbers(tmp_path: Path) -> None:
    shutil.copy(OURS / "scores.csv", tmp_path)
    has = ["Rscript", "-e", "stopifnot(requireNamespace('lmerTest'), requireNamespace('pbkrtest'))"]
    if subprocess.run(has, capture_output=True, check=False).returncode:
        pytest.skip("R lacks lmerTest or pbkrtest")
    script = OURS / "mixed_reference.R"
    ran = subprocess.run(
        ["Rscript", str(script)], cwd=tmp_path, capture_output=True, text=True, check=True
    )
    found = {dataset: ours(fit_of(dataset)) for dataset in RANDOM}
    for row in csv.DictReader(ran.stdout.splitlines()):
        assert found[row["dataset"]][row["quantity"]] == pytest.approx(
            float(row["value"]), rel=1e-6, abs=1e-10
        ), row
