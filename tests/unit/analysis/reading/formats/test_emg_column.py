"""Muscle activity in tables: which columns are muscles, and in what unit."""

import numpy as np
import pytest

from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.core.records import EMG_CHANNELS

N = 400


@pytest.fixture
def columns():
    rng = np.random.default_rng(3)
    return {
        "time_s": np.arange(N) / 100,
        "torque_nm": rng.normal(size=N),
        "angle_rad": rng.normal(size=N),
    }


EMG = 1e-5 * np.random.default_rng(4).normal(size=N)


def read(held, **options):
    """Return channels of EMG and the texts of the notices."""
    (epoch,), notices = epochs_from_table(Table("t", held), ReadOptions(**options))
    channels = {name: c for name, c in epoch.channels.items() if name.startswith("emg")}
    return channels, [notice.text for notice in notices]


@pytest.mark.parametrize("name", ["emg_v", "emg_2_v"])
def test_microvolts_are_told(columns, name):
    _, (text,) = read({**columns, name: 1e6 * EMG})
    option = name.removesuffix("_v")
    assert f"{name} reaches" in text
    assert f"looks like microvolts: say --unit {option}=uV" in text


@pytest.mark.parametrize(
    ("names", "scales"),
    [
        (["emg_v"], [1]),
        (["emg_mv"], [1e3]),
        (["emg_uv", "emg_2_uv"], [1e6, 1e6]),
        (["EMG biceps [mV]", "EMG triceps [µV]"], [1e3, 1e6]),
        (["sEMG 1 (uV)", "emg_2_v"], [1e6, 1]),
        (["emg_2_v", "emg_v"], [1, 1]),
    ],
)
def test_each_muscle_is_read_in_volts(columns, names, scales):
    own = {n: k * s * EMG for k, (n, s) in enumerate(zip(names, scales, strict=True), start=1)}
    said = {} if set(names) <= set(EMG_CHANNELS) else dict(zip(EMG_CHANNELS, names, strict=False))
    channels, told = read({**columns, **own}, columns=said)
    assert told == []
    muscles = {"emg_v": 1, "emg_2_v": 2}
    if names[0] == "emg_2_v":  # names of our own say which
        muscles = {"emg_v": 2, "emg_2_v": 1}
    assert len(channels) == len(names)
    for name, one in channels.items():
        np.testing.assert_allclose(one.values, muscles[name] * EMG)


def test_a_unit_or_a_scale_of_emg_is_that_of_every_muscle(columns):
    own = {"EMG1": 1e3 * EMG, "EMG2": 2e3 * EMG, "EMG3": 3 * EMG}
    channels, told = read({**columns, **own}, units={"emg": "mV", "emg_3": "V"})
    assert told == []
    for k, one in enumerate(channels.values(), start=1):
        np.testing.assert_allclose(one.values, k * EMG)
    channels, _ = read({**columns, "EMG1": EMG, "EMG2": EMG}, scales={"emg": "0.002 V"},
                       units={"emg": "counts"})  # fmt: skip
    np.testing.assert_allclose(channels["emg_2_v"].values, 0.002 * EMG)


def test_where_the_user_names_muscles_those_are_all(columns):
    own = {"EMG1 [mV]": EMG, "EMG2 [mV]": 2 * EMG, "EMG3 [mV]": 3 * EMG}
    named = {"emg": "EMG3 [mV]", "emg_2": "EMG1 [mV]"}
    channels, told = read({**columns, **own}, columns=named)
    assert told == []
    assert list(channels) == ["emg_v", "emg_2_v"]
    np.testing.assert_allclose(channels["emg_v"].values, 3e-3 * EMG)
    np.testing.assert_allclose(channels["emg_2_v"].values, 1e-3 * EMG)


def test_what_is_no_raw_emg_is_told_and_not_used(columns):
    own = {"EMG rms [mV]": EMG, "EMG filt [mV]": EMG, "EMG [%]": EMG, "EMG biceps [mV]": EMG}
    channels, told = read({**columns, **own}, units={"emg_2": "mV"})
    assert told == [
        "t: column 'EMG rms [mV]' is not used: it is not the raw EMG",
        "t: column 'EMG filt [mV]' is not used: it is not the raw EMG",
        "t: column 'EMG [%]' is not used: it is in %, and EMG is needed in V or mV",
    ]
    np.testing.assert_allclose(channels["emg_v"].values, 1e-3 * EMG)
    many = {f"EMG {k} [V]": EMG for k in range(9)}
    channels, told = read({**columns, **many}, units={"emg": "V"})
    assert len(channels) == 8
    assert told == ["t: column 'EMG 8 [V]' is not used: 8 muscles are read at most"]


def test_what_looks_like_emg_is_told_and_not_used(columns):
    channels, (told,) = read({**columns, "EMG1": EMG, "EMG biceps [mV]": EMG})
    assert not channels
    assert told == (
        "t: what looks like EMG is not used; to leave out active stretches, say "
        "--column emg=EMG1 --column 'emg_2=EMG biceps [mV]'"
    )


def test_a_column_is_one_muscle(columns):
    """`emg_2_v` named as the first muscle is not the second too."""
    channels, _ = read({**columns, "emg_2_v": EMG}, columns={"emg": "emg_2_v"})
    assert list(channels) == ["emg_v"]
    assert channels["emg_v"].spoken == "emg_v (column emg_2_v)"
