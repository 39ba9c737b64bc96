"""A measured human ankle, from the file to J, B and K, by the command line."""

import json
import sys

import numpy as np
import pytest
import scipy.io

from rigidimeter.analysis.estimation import epoch_signals, fit_inertia_damping_stiffness
from rigidimeter.analysis.reading import ReadOptions, read_recording
from rigidimeter.cli.main import main
from rigidimeter.core.errors import UserError
from rigidimeter.core.settings import Settings

PUBLISHED = {"inertia_kg_m2": 0.0175, "damping_nm_s_rad": 1.25, "stiffness_nm_rad": 103.0}
"""Least squares on the whole recording, at 100 samples/s (shared data, README)."""

NAMES = ["--column", "angle_rad=position_rad", "--column", "torque_nm=torque_Nm"]
OPTIONS = ["--rate-hz", "1000", "--reaction", "--epoch-length-s", "20"]


def estimate(path, out, *options):
    arguments = ["rigidimeter", "estimate", path, *options, "--json", out]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", list(map(str, arguments)))
        with pytest.raises(SystemExit) as ended:
            main()
    assert not ended.value.code
    return json.loads(out.read_text())


@pytest.fixture(scope="module")
def ankle(shared_data, tmp_path_factory):
    path = shared_data / "ankle" / "z_df.npz"
    out = tmp_path_factory.mktemp("ankle") / "npz.json"
    return path, estimate(path, out, *NAMES, *OPTIONS)


def test_without_weights_each_epoch_is_within_a_tenth_of_the_known_fit(ankle):
    path, reference = ankle
    assert [epoch["outcome"] for epoch in reference["epochs"]] == ["included"] * 3
    named = dict(name.split("=") for name in NAMES[1::2])
    options = ReadOptions(named, epoch_length_s=20.0, rate_hz=1000.0, reaction=True)
    epochs, _ = read_recording(path, options)
    signals = [epoch_signals(one, Settings(), "bandlimited") for one in epochs]
    fits = [fit_inertia_damping_stiffness(one) for one in signals]
    for fit in fits:
        np.testing.assert_allclose(fit.value, list(PUBLISHED.values()), rtol=0.1)
    assert np.mean([fit.vaf_percent for fit in fits]) >= 87.0


def test_weighted_by_their_noise_lines_give_a_stiffer_joint_and_it_is_said(ankle):
    """The joint is not J, B and K alone: what the model lacks is weighted like the joint."""
    for epoch in ankle[1]["epochs"]:
        assert 1.1 < epoch["stiffness_nm_rad"] / PUBLISHED["stiffness_nm_rad"] < 1.4
        assert {f["name"] for f in epoch["findings"]} & {"missing_term", "unweighted_fit"}


def same_but_for_the_source(one, two):
    for a, b in zip(one["epochs"], two["epochs"], strict=True):
        for key in a.keys() - {"source"}:
            assert a[key] == b[key], key


def test_the_same_numbers_from_a_matlab_file(ankle, tmp_path):
    path, reference = ankle
    with np.load(path) as archive:
        scipy.io.savemat(tmp_path / "ankle.mat", {k: archive[k] for k in archive.files})
    found = estimate(tmp_path / "ankle.mat", tmp_path / "mat.json", *NAMES, *OPTIONS)
    same_but_for_the_source(found, reference)


def test_the_same_numbers_from_a_text_file(ankle, tmp_path):
    path, reference = ankle
    with np.load(path) as archive:
        angle, torque = archive["position_rad"], archive["torque_Nm"]
    rows = zip(
        (np.arange(angle.size) / 1000).tolist(), angle.tolist(), torque.tolist(), strict=True
    )
    text = "time_s,angle_rad,torque_nm\n" + "".join(f"{t!r},{a!r},{m!r}\n" for t, a, m in rows)
    (tmp_path / "ankle.csv").write_text(text)
    found = estimate(tmp_path / "ankle.csv", tmp_path / "csv.json", "--reaction",
                     "--epoch-length-s", 20)  # fmt: skip
    same_but_for_the_source(found, reference)


def test_the_wrong_sign_shows_itself(ankle, tmp_path):
    path, _ = ankle
    options = ReadOptions(dict(name.split("=") for name in NAMES[1::2]), epoch_length_s=20.0)
    with pytest.raises(UserError, match=r"has the sign of the joint's reaction.*say --reaction"):
        read_recording(path, options)
