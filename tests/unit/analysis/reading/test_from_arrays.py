import doctest
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rigidimeter.analysis.estimation import METHODS, fit_epoch
from rigidimeter.analysis.reading import from_arrays, identify
from rigidimeter.core.records import Channel, Epoch
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.virtual.batch import simulate_epochs

RATE_HZ = 1000.0
MOTION = ("angle_rad", "velocity_rad_s", "velocity_command_rad_s")


@pytest.fixture(scope="module")
def arrays() -> dict[str, np.ndarray]:
    """One simulated epoch, every channel at 1000 samples/s and on one clock."""
    settings = parse_settings({"protocol": {"blocks": [{"epochs": 1}]}})
    epoch = simulate_epochs(settings, 1, conditions="OFF", seed=3).epoch(0)
    first = max(channel.time_s[0] for channel in epoch.channels.values())
    last = min(channel.time_s[-1] for channel in epoch.channels.values())
    time_s = first + np.arange(int(min(last - first, 14.0) * RATE_HZ)) / RATE_HZ
    return {
        name: np.interp(time_s, channel.time_s, channel.values)
        for name, channel in epoch.channels.items()
        if name != "emg_v"
    }


@pytest.fixture(scope="module")
def csv_file(arrays: dict[str, np.ndarray], tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("arrays") / "a.csv"
    table = np.column_stack(list(arrays.values()))
    np.savetxt(path, table, "%.17g", ",", header=",".join(arrays), comments="")
    return path


@pytest.mark.parametrize("method", ["auto", "published", "bandlimited", "iv", "spectral"])
def test_identify_gives_the_numbers_of_estimate(arrays, csv_file, rigidimeter, tmp_path, method):
    options = ["--rate-hz", 1000, "--task", "prbs", "--method", method]
    ran = rigidimeter("estimate", csv_file, *options, "--json", tmp_path / "a.json")
    assert ran.status == 0, ran.err
    document = json.loads((tmp_path / "a.json").read_text())
    fit = identify(**arrays, rate_hz=RATE_HZ, method=method)
    assert fit.method == document["method"]
    (row,) = document["epochs"]
    for name in row.keys() - {"source", "epoch", "condition", "outcome", "reason", "findings"}:
        value = list(fit.band_hz) if name == "band_hz" else getattr(fit, name)
        assert value == row[name], name
    assert [found.name for found in fit.findings] == [found["name"] for found in row["findings"]]


def test_degrees_are_refused_as_on_the_command_line(arrays, rigidimeter, tmp_path):
    motion = {name: np.degrees(v) for name, v in arrays.items() if name in MOTION}
    wrong = {**arrays, **motion}
    path, table = tmp_path / "deg.csv", np.column_stack(list(wrong.values()))
    np.savetxt(path, table, "%.17g", ",", header=",".join(wrong), comments="")
    ran = rigidimeter("estimate", path, "--rate-hz", 1000, "--task", "prbs")
    assert ran.status != 0
    with pytest.raises(ValueError, match="angle_rad is taken to be in rad, but") as refused:
        identify(**wrong, rate_hz=RATE_HZ)
    reason = str(refused.value).partition("but ")[2].partition(";")[0]
    assert reason in ran.err
    fit = identify(**wrong, rate_hz=RATE_HZ, check_units=False)
    right = identify(**arrays, rate_hz=RATE_HZ)
    assert fit.stiffness_nm_rad == pytest.approx(right.stiffness_nm_rad * np.pi / 180, rel=0.05)


def test_time_stamps_serve_as_well_as_a_rate(arrays):
    time_s = 3.0 + np.arange(arrays["torque_nm"].size) / RATE_HZ
    stamped = identify(**arrays, time_s=time_s)
    np.testing.assert_allclose(stamped.value, identify(**arrays, rate_hz=RATE_HZ).value, rtol=1e-6)


def test_settings_are_used(arrays):
    settings = parse_settings({"estimation": {"band_high_closed_loop_hz": 12.0}})
    assert identify(**arrays, rate_hz=RATE_HZ, settings=settings).band_hz[1] < 12.1


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"method": "magic"}, "no such method; the nearest is"),
        ({"method": "iv", "perturbation_nm": None}, "method iv needs perturbation_nm"),
        ({"angle_rad": None, "velocity_rad_s": None}, "neither velocity_rad_s nor angle_rad"),
        ({"torque_nm": np.ones((10, 2))}, r"torque_nm must have one dimension, not .*\(10, 2\)"),
        ({"angle_rad": np.ones(10)}, "angle_rad has 10 samples, but torque_nm has"),
        ({"rate_hz": None}, "either rate_hz or time_s"),
        ({"time_s": np.arange(5.0)}, "either rate_hz or time_s"),
        ({"rate_hz": None, "time_s": np.arange(5.0)}, "time_s has 5 samples, but torque_nm has"),
        ({"rate_hz": -1.0}, "rate_hz must be a number greater than 0"),
        ({"rate_hz": "1000"}, "rate_hz must be a number greater than 0, got '1000'"),
        ({"torque_nm": "0.1"}, "one dimension"),
        ({"torque_nm": None}, "torque_nm is None"),
        ({"torque_nm": ["a", "b"]}, "torque_nm is not an array of numbers"),
        ({"angle_rad": np.ones(10) * 1j}, "angle_rad has complex or masked samples"),
        ({"angle_rad": np.ma.masked_less(np.arange(10.0), 5)}, "complex or masked samples"),
    ],
)
def test_what_cannot_be_used_is_refused(arrays, change, words):
    with pytest.raises(ValueError, match=words):
        identify(**{**arrays, "rate_hz": RATE_HZ, **change})


def test_two_methods_of_one_name_are_refused(arrays):
    METHODS.append(replace(METHODS[0], name="iv"))
    try:
        with pytest.raises(ValueError, match="two methods have the name iv"):
            identify(**arrays, rate_hz=RATE_HZ)
    finally:
        METHODS.pop()


def test_the_example_of_the_docstring_runs():
    assert doctest.testmod(from_arrays).failed == 0


def test_numbers_must_be_finite_and_time_must_increase(arrays):
    torque = arrays["torque_nm"].copy()
    torque[7] = np.nan
    with pytest.raises(ValueError, match="torque_nm is nan at sample 7"):
        identify(**{**arrays, "torque_nm": torque}, rate_hz=RATE_HZ)
    time_s = np.arange(torque.size) / RATE_HZ
    time_s[5] = time_s[4]
    with pytest.raises(ValueError, match="time_s must increase"):
        identify(**arrays, time_s=time_s)


def test_a_single_epoch_is_fitted_by_the_method_asked_for(arrays):
    time_s = np.arange(arrays["torque_nm"].size) / RATE_HZ
    channels = {name: Channel(name, time_s, values) for name, values in arrays.items()}
    epoch = Epoch("file", "1", channels)
    by_iv = fit_epoch(epoch, "iv", Settings())
    assert (by_iv.method, by_iv.band_hz[1]) == ("iv", pytest.approx(30.0, abs=0.1))
    assert not np.array_equal(by_iv.value, fit_epoch(epoch, "bandlimited", Settings()).value)
    with pytest.raises(ValueError, match="no such method"):
        fit_epoch(epoch, "magic", Settings())
