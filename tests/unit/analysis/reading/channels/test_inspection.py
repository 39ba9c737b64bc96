"""What is proposed for a file, and mapping files that say it."""

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading.channels.channels_of_table import channels_of_table
from rigidimeter.analysis.reading.channels.inspection import (
    column_rows,
    inspect_table,
    option_words,
)
from rigidimeter.analysis.reading.channels.mapping_file import mapping_text, merged, read_mapping
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError

TIME_S = np.arange(9000) / 200.0
TORQUE_NM, ANGLE_RAD = torque_nm(TIME_S), angle_rad(TIME_S)
ANGLE_DEG = np.degrees(ANGLE_RAD)


def inspected(options=None, **columns):
    return inspect_table(Table("r.csv", columns), options or ReadOptions())


def test_a_time_that_runs_backwards_is_told_so_and_has_no_trials():
    columns = {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": ANGLE_RAD}
    found = inspected(**{name: values[::-1].copy() for name, values in columns.items()})
    assert "time_s goes back" in found.proposal.unsaid[0]
    assert "epoch" not in found.options.columns


def test_the_screen_has_rate_gaps_and_role_of_each_column():
    angle = ANGLE_DEG.copy()
    angle[2000:2040] = np.nan
    rows = column_rows(inspected(**{"t [s]": TIME_S, "M [Nm]": TORQUE_NM, "Winkel [°]": angle}))
    assert rows[3] == ("Winkel [°]", "°", "200", "0.0 %", "1", "40", rows[3][6], "angle_rad")


def test_a_mapping_says_what_the_options_said(tmp_path):
    options = ReadOptions(
        {"torque": 'F "z"', "angle_rad": "θ", "epoch": "Trial"}, None, True, 20.0, task="prbs",
        units={"torque": "mV"}, scales={"torque": "2.5 Nm/V"}, offsets={"torque_nm": "12 mV"},
    )  # fmt: skip
    path = tmp_path / "lab.toml"
    path.write_text(mapping_text(options), "utf-8")
    found = read_mapping(path)
    assert found.said.columns == options.said.columns
    assert found.said.units == {"torque_nm": "mV", "angle_rad": "rad"}
    assert (found.said.scales, found.said.offsets) == (options.said.scales, options.said.offsets)
    assert (found.reaction, found.epoch_length_s, found.task) == (True, 20.0, "prbs")
    over = merged(found, ReadOptions(units={"torque_nm": "V"}, epoch_length_s=5.0))
    assert over.said.units["torque_nm"] == "V"
    assert (over.epoch_length_s, over.reaction) == (5.0, True)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", 'schema is missing; its first line must be schema = "rigidimeter.map'),
        ('schema = "rigidimeter.mapping/9"', "schema is 'rigidimeter.mapping/9'"),
        ('schema = "rigidimeter.mapping/1"\n[torqe]\ncolumn = "a"', "the nearest is torque"),
        ('schema = "rigidimeter.mapping/1"\n[torque]\nunits = "a"', "the nearest is torque.unit"),
        ('schema = "rigidimeter.mapping/1"\nrate_hz = 0.0', "greater than 0, in Hz"),
        ('schema = "rigidimeter.mapping/1"\nrate_hz = 1e300', "must be from 0.001 to 1e"),
    ],
)
def test_a_wrong_mapping_is_refused(tmp_path, text, told):
    path = tmp_path / "lab.toml"
    path.write_text(text)
    with pytest.raises(UserError, match=r"^.*lab\.toml: ") as caught:
        read_mapping(path)
    assert told in str(caught.value)


@pytest.mark.parametrize("per_s", [300.0, 1000.0, 2000.0, 1e4])
def test_ticks_of_a_clock_are_not_taken_for_milliseconds(per_s):
    """2,000 ticks/s at 200 samples/s look like ms at 100: J would be 4 times too large."""
    time_s = np.arange(9000) / 100.0
    columns = {"torque_nm": torque_nm(time_s), "angle_rad": angle_rad(time_s)}
    found = inspected(time=per_s * time_s, **columns)
    assert "--scale 'time=0.0001 s'" in found.proposal.unsaid[0]
    said = inspected(
        ReadOptions(scales={"time": f"{1 / per_s!r} s"}), time=per_s * time_s, **columns
    )
    assert said.proposal.unsaid == ()
    np.testing.assert_allclose(said.proposal.seen.fit.value[0], 0.0063, rtol=0.1)


@pytest.mark.parametrize("name", ["t", "time_s"])
def test_sample_numbers_are_not_taken_for_milliseconds(name):
    """At 200 samples/s, J would be 25 times too small in ms, B 5 times; K would be right."""
    columns = {name: np.arange(9000.0), "torque_nm": TORQUE_NM, "angle_rad": ANGLE_RAD}
    found = inspected(**columns)
    assert "--rate-hz" in found.proposal.unsaid[0]
    assert "--unit time=s or --unit time=ms" in found.proposal.unsaid[0]
    found = inspected(ReadOptions(rate_hz=200.0), **columns)
    assert found.proposal.unsaid == ()
    assert option_words(found)[:2] == ["--rate-hz", "200"]
    read = channels_of_table(found.table, found.options)
    np.testing.assert_allclose(read.time_s, TIME_S)
    np.testing.assert_allclose(found.proposal.seen.fit.value[0], 0.0063, rtol=0.1)
    said = inspected(ReadOptions(units={"time": "ms"}), **columns)
    assert said.proposal.unsaid == ()
    stated = inspected(**{"t [ms]": np.arange(9000.0)}, torque_nm=TORQUE_NM, angle_rad=ANGLE_RAD)
    assert stated.proposal.unsaid == ()


@pytest.mark.parametrize(
    "columns",
    [
        {"time": 1e4 * TIME_S, "torque_nm": TORQUE_NM, "angle_rad": ANGLE_RAD},
        {"timestamp": 3e4 * TIME_S, "torque_nm": TORQUE_NM, "angle_rad": ANGLE_RAD},
        {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle": 1e3 * ANGLE_RAD},
        {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle": 10 * ANGLE_DEG},
    ],
    ids=["0.1 ms", "ticks of 30 kHz", "mrad", "0.1 deg"],
)
def test_a_unit_that_is_not_usual_is_not_taken_for_the_only_usual_one_left(columns):
    """ms of 10 kHz, or degrees that are mrad, are possible, but too slow or fast to be believed."""
    found = inspected(**columns)
    assert "--unit" in found.proposal.unsaid[0]
    assert found.options.units == {}
