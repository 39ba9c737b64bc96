"""Two recordings of one joint, each with its clock: their offset, and the samples of both."""

import numpy as np
import pytest
from tests.known_joint import (
    angle_rad,
    torque_nm,
)

from rigidimeter.analysis.reading.channels.joining import join_tables, offset_notice
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.analysis.reading.formats.table_epochs import epochs_from_table
from rigidimeter.core.errors import UserError

TORQUE_S = 0.0013 + np.arange(12_000) / 750.0
MOTION_S = np.arange(3_000) / 200.0


def tables(offset_s=0.0):
    torque = Table("m.csv", {"t [ms]": 1e3 * TORQUE_S, "M [Nm]": torque_nm(TORQUE_S)})
    angle = np.degrees(angle_rad(MOTION_S))
    return [torque, Table("a.csv", {"t [s]": MOTION_S - offset_s, "phi [deg]": angle})]


def test_it_is_added_to_the_second_clock_and_said():
    joined, offset = join_tables(tables(0.3712), ReadOptions(), "found")
    (epoch,), _ = epochs_from_table(joined, ReadOptions())
    notice = offset_notice(offset, "a.csv")
    np.testing.assert_allclose(epoch.channels["angle_rad"].time_s, MOTION_S[1:], atol=1e-3)
    assert "a.csv: 0.371" in notice.text
    _, other = join_tables(tables(0.3712)[::-1], ReadOptions(), "found")
    assert other.value_s == pytest.approx(-0.3712, abs=1e-3)
    given, _ = join_tables(tables(0.25), ReadOptions(), 0.25)
    assert np.max(given.columns["time_s"]) == pytest.approx(MOTION_S[-1])


def test_a_label_holds_in_the_rows_of_the_other_clock():
    torque, motion = tables()
    motion.columns["epoch"] = np.repeat(["1", "2"], 1500).astype(object)
    joined, _ = join_tables([torque, motion], ReadOptions(), None)
    first, second = epochs_from_table(joined, ReadOptions())[0]
    assert first.channels["torque_nm"].time_s[-1] < 7.5 <= second.channels["torque_nm"].time_s[0]
    assert len(first.channels["angle_rad"]) == 1499


@pytest.mark.parametrize(
    ("changed", "offset", "told"),
    [
        ({"t [s]": MOTION_S + 99}, None, "the clocks have nothing in common .* --clock-offset"),
        ({}, "later", "write seconds, or found"),
        ({"phi [deg]": np.random.default_rng(1).normal(size=3000)}, "found", "at no offset"),
        ({"phi [deg]": np.sin(3 * MOTION_S), "t [s]": MOTION_S}, "found", "--clock-offset found"),
        ({"t": MOTION_S, "t [s]": None}, None, "the unit of 't' is stated nowhere"),
    ],
)
def test_what_cannot_be_joined_is_refused(changed, offset, told):
    torque, motion = tables()
    columns = {k: v for k, v in (motion.columns | changed).items() if v is not None}
    with pytest.raises(UserError, match=told):
        join_tables([torque, Table("a.csv", columns)], ReadOptions(), offset)


def test_one_recording_is_not_joined():
    with pytest.raises(UserError, match="name two recordings or more"):
        join_tables(tables()[:1], ReadOptions(), None)
