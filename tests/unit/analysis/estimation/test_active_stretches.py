"""Stretches in which a muscle was active by itself are left out of the fit; reflexes stay in."""

from dataclasses import replace

import numpy as np
import pytest
from tests.pushes import JOINT, epochs_with_emg, with_reflex_emg
from typer.testing import CliRunner

from rigidimeter.analysis.reading import (
    Recording,
    estimates_document,
    read_estimates,
    write_estimates_json,
)
from rigidimeter.analysis.report.epoch_traces import page_traces
from rigidimeter.analysis.study import estimate, recording_result, result_table
from rigidimeter.cli.main import app
from rigidimeter.core.files import csv_text
from rigidimeter.core.findings import UNKNOWN_EFFECT
from rigidimeter.core.settings import changed_settings

TRUTH = np.array([JOINT.inertia_kg_m2, JOINT.damping_nm_s_rad, JOINT.stiffness_nm_rad])
KEEP = {"estimation": {"leave_out_active": False}}


@pytest.fixture(scope="module")
def pushed():
    return epochs_with_emg(1, voluntary_nm=0.5, seed=3)


@pytest.fixture(scope="module")
def relaxed():
    return epochs_with_emg(2, seed=3)


def found(analysis):
    return [[one for one in fit.findings if one.name == "emg_activity"] for fit in analysis.fits]


def without_emg(epoch):
    channels = {k: c for k, c in epoch.channels.items() if not k.startswith("emg")}
    return replace(epoch, channels=channels)


def measured_alone(epoch):
    channels = {k: c for k, c in epoch.channels.items() if k not in CAUSES}
    return replace(epoch, channels=channels)


CAUSES = ("perturbation_nm", "velocity_command_rad_s")


@pytest.mark.parametrize("method", ["iv", "published"])
def test_pushes_are_left_out_and_both_values_shown_where_that_matters(pushed, method):
    """The intervals of `published` take the residual for white: leaving out moves it beyond."""
    settings, [(epoch, pushes)] = pushed
    analysis = estimate([epoch], method, settings=settings)
    (fit,), ((finding,),) = analysis.fits, found(analysis)
    (kept,) = estimate([epoch], method, settings=changed_settings(settings, KEEP)).fits
    for start_s, stop_s in pushes:
        assert any(s.start_s < stop_s and s.stop_s > start_s for s in fit.activity.stretches)
    assert 5 < fit.activity.active_percent < fit.activity.left_out_percent < 20
    assert kept.activity.left_out_percent == 0
    assert np.max(np.abs(kept.value / fit.value - 1)) > 0.02
    moved = np.abs(kept.value - fit.value) > 0.5 * (kept.high - kept.low)
    assert np.any(moved) == (method == "published")
    assert finding.level == ("caution" if method == "published" else "note")
    assert (" with them and " in finding.details) == (method == "published")
    assert "from " in finding.details
    if method == "iv":
        assert np.all(np.abs(fit.value / TRUTH - 1) < 0.005)


def test_stretches_are_chosen_from_the_emg_alone(pushed):
    settings, epochs = pushed
    epoch = epochs[0].epoch
    torque = epoch.channels["torque_nm"]
    noisy = torque.values + np.random.default_rng(1).normal(size=len(torque))
    other = replace(epoch, channels={**epoch.channels, "torque_nm": replace(torque, values=noisy)})
    one, two = (estimate([each], settings=settings).fits[0] for each in (epoch, other))
    assert one.activity.stretches == two.activity.stretches


def test_a_relaxed_subject_is_fitted_as_without_emg(relaxed):
    settings, epochs = relaxed
    analysis = estimate([one.epoch for one in epochs], settings=settings)
    plain = estimate([without_emg(one.epoch) for one in epochs], settings=settings)
    assert not any(found(analysis))
    for one, other in zip(analysis.fits, plain.fits, strict=True):
        assert one.activity.stretches == ()
        assert other.activity is None
        assert replace(one, activity=None) == other
        assert "active_percent" not in other.row()


@pytest.mark.parametrize("seen", [lambda epoch: epoch, measured_alone])
def test_a_reflex_stays_in_and_is_reported(relaxed, seen):
    settings, epochs = relaxed
    rng = np.random.default_rng(2)
    answered = [seen(with_reflex_emg(one.epoch, 0.2, 0.1, rng)) for one in epochs]
    analysis = estimate(answered, settings=settings)
    plain = estimate(map(without_emg, answered), settings=settings)
    for fit, same, (finding,) in zip(analysis.fits, plain.fits, found(analysis), strict=True):
        assert all(one.locked for one in fit.activity.stretches)
        assert fit.activity.left_out_percent == 0
        assert np.array_equal(fit.value, same.value)
        assert "with the motion" in finding.headline


def test_a_muscle_active_throughout_an_epoch_stands_out_of_the_recording(relaxed):
    """Rest is that of the recording: the epoch itself has none."""
    settings, epochs = relaxed
    loud = epochs[0].epoch
    emg = loud.channels["emg_v"]
    throughout = replace(emg, values=10 * emg.values)
    loud = replace(loud, channels={**loud.channels, "emg_v": throughout})
    analysis = estimate([loud, epochs[1].epoch], settings=settings)
    assert analysis.fits[0].activity.active_percent > 95
    assert analysis.fits[0].activity.left_out_percent == 0  # too little would be left
    assert analysis.fits[1].activity.active_percent == 0
    assert "nothing is left out" in found(analysis)[0][0].details


@pytest.mark.parametrize(
    ("bursts", "method", "level"),
    [(2, "iv", "note"), (5, "iv", "caution"), (5, "published", "caution")],
)
def test_bursts_that_take_too_much_with_their_sides_are_said(relaxed, bursts, method, level):
    """Below the limit of the activity too: 5 of 0.6 s, each with 2.2 s around it, of 18 s."""
    settings, epochs = relaxed
    epoch = epochs[0].epoch
    emg = epoch.channels["emg_v"]
    starts_s = emg.time_s[0] + 2.0 + 16.0 * np.arange(bursts) / (bursts - 0.5)
    loud = np.any([(emg.time_s > s) & (emg.time_s < s + 0.6) for s in starts_s], axis=0)
    channel = replace(emg, values=np.where(loud, 20.0, 1.0) * emg.values)
    pulled = replace(epoch, channels={**epoch.channels, "emg_v": channel})
    analysis = estimate([pulled], method, settings=settings)
    (fit,), ((finding,),) = analysis.fits, found(analysis)
    assert fit.activity.active_percent < 20 == settings.diagnostics.max_emg_active_percent
    assert finding.level == level
    assert (fit.activity.left_out_percent == 0) == (level == "caution")
    if level == "note":
        return
    assert f"nothing is left out: {fit.activity.kept}" in finding.details
    assert fit.activity.kept.startswith("with 1 s on each side that would take")
    assert "(at most 50 %)" in finding.details
    assert finding.effect == UNKNOWN_EFFECT
    stricter = {"diagnostics": {"levels": {"emg_activity": "exclude"}}}
    (strict,) = estimate([pulled], method, settings=changed_settings(settings, stricter)).fits
    assert not strict.outcome.included


def test_activity_is_in_files_and_read_back(pushed, tmp_path):
    settings, epochs = pushed
    analysis = estimate([one.epoch for one in epochs], settings=settings)
    write_estimates_json(tmp_path / "estimates.json", analysis)
    assert read_estimates(tmp_path / "estimates.json").fits[0].activity == analysis.fits[0].activity
    row = estimates_document(analysis)["epochs"][0]
    assert row["active_stretches"][0].keys() == {"start_s", "stop_s", "channel", "locked"}
    assert 0 < row["cocontraction_percent"] < 100
    text = csv_text(list(analysis.rows()[0]), analysis.rows())
    assert "active_left_out_percent" in text
    assert " s emg_v" in text


def test_a_column_that_looks_like_emg_is_used_where_the_user_names_it(pushed, tmp_path):
    _, epochs = pushed
    epoch = epochs[0].epoch
    time_s = epoch.channels["emg_v"].time_s[::2]
    columns = {
        name: np.interp(time_s, one.time_s, one.values)
        for name, one in epoch.channels.items()
        if name in ("torque_nm", "angle_rad", "velocity_rad_s")
    }
    columns["EMG biceps [V]"] = epoch.channels["emg_v"].values[::2]
    table = tmp_path / "elbow.csv"
    rows = np.column_stack([time_s, *columns.values()])
    np.savetxt(table, rows, delimiter=",", header=",".join(["time_s", *columns]), comments="")
    named, found = ["--column", "emg=EMG biceps [V]"], []
    for more in ([], named, [*named, "--keep-active"]):
        out = tmp_path / "estimates.json"
        result = CliRunner().invoke(app, ["estimate", str(table), "--json", str(out), *more])
        assert result.exit_code == 0, result.output
        found.append(read_estimates(out).fits[0])
    unnamed, named_fit, kept = found
    assert unnamed.activity is None
    assert named_fit.activity.left_out_percent > 5
    assert any("emg_v (column EMG biceps [V])" in one.details for one in named_fit.findings)
    assert kept.activity.left_out_percent == 0


def test_cocontraction_is_high_where_both_muscles_pull_and_low_where_they_alternate(relaxed):
    settings, epochs = relaxed
    epoch = epochs[0].epoch
    emg = epoch.channels["emg_v"]
    loud = np.where(emg.time_s % 2 < 1, 20.0, 1.0), np.where(emg.time_s % 2 < 1, 1.0, 20.0)

    def percent(other):
        channels = {
            "emg_v": replace(emg, values=loud[0] * emg.values),
            "emg_2_v": replace(emg, name="emg_2_v", values=other * emg.values),
        }
        one = replace(epoch, channels={**epoch.channels, **channels})
        return estimate([one], settings=settings).fits[0].activity.cocontraction_percent

    assert percent(loud[0]) > 95
    assert percent(loud[1]) < 30


def test_tables_have_the_share_of_the_epoch_and_traces_are_shaded(pushed):
    settings, [(epoch, _)] = pushed
    recording = Recording((epoch,), (), settings, ())
    analysis = estimate(recording)
    result = recording_result(recording, analysis, "")
    first = analysis.fits[0].activity.stretches[0]
    (row,) = result_table(result, "estimates")
    assert row["active_left_out_percent"] == analysis.fits[0].activity.left_out_percent
    assert f"{first.start_s:.4g} to {first.stop_s:.4g} s {first.channel}" in row["active_stretches"]
    (trace,) = page_traces(result).values()
    assert trace["active"][0] == pytest.approx((first.start_s, first.stop_s), abs=0.002)
    assert "a muscle was active" in trace["words"]
