"""Which columns are taken, in what unit; and what is refused, on a joint of known J, B and K."""

import numpy as np
import pytest
from tests.known_joint import angle_rad, torque_nm

from rigidimeter.analysis.reading.channels.channels_of_table import channels_of_table
from rigidimeter.analysis.reading.channels.readings import BELIEVED_SPEED_RAD_S, BELIEVED_TORQUE_NM
from rigidimeter.analysis.reading.formats.read_options import ReadOptions
from rigidimeter.analysis.reading.formats.table import Table
from rigidimeter.core.errors import UserError

TIME_S = np.arange(4000) / 200.0
TORQUE_NM, ANGLE_RAD = torque_nm(TIME_S), angle_rad(TIME_S)
ANGLE_DEG = np.degrees(ANGLE_RAD)
VELOCITY_RAD_S = angle_rad(TIME_S, derivative=1)


def table(units=None, **columns):
    return Table("r.csv", {k: np.asarray(v) for k, v in columns.items()}, units=units or {})


def refusal(data, **options) -> list[str]:
    with pytest.raises(UserError) as caught:
        channels_of_table(data, ReadOptions(**options))
    return list(caught.value.lines)


def assert_si(found):
    np.testing.assert_allclose(found.time_s, TIME_S, rtol=1e-12)
    np.testing.assert_allclose(found.values["torque_nm"], TORQUE_NM, rtol=1e-12)
    np.testing.assert_allclose(found.values["angle_rad"], ANGLE_RAD, rtol=1e-12)


def test_units_stated_nowhere_are_shown_under_each_reading():
    first, *shown = refusal(table(time=TIME_S, torque=TORQUE_NM, angle=ANGLE_DEG / 3))
    assert "the unit of 'time', 'torque', 'angle' is stated nowhere" in first
    for option in ("time=s", "time=ms", "torque=Nm", "angle=rad", "angle=deg"):
        assert f"--unit {option}" in first
    assert len(shown) == 4
    assert "time as s, torque as Nm, angle as deg: 200 samples/s for 20 s" in shown[1]
    assert "K 5.4 N·m/rad" in shown[1]  # a third of the angle: three times as stiff
    assert "K 0.094 N·m/rad" in shown[0]


def test_every_fault_is_said_at_once():
    data = table(time=TIME_S, **{"M1 [Nm]": TORQUE_NM, "M2 [Nm]": TORQUE_NM, "F (N)": TORQUE_NM})
    data.columns["angle"] = ANGLE_DEG
    lines = refusal(data, columns={"torque": "M 3"}, units={"angle": "furlong"})
    text = "\n".join(lines)
    assert "there is no column M 3" in text
    assert "--unit angle=furlong: unknown unit 'furlong'; known for angle" in text


def test_what_is_optional_and_in_doubt_is_not_used_and_said():
    data = table(
        time_s=TIME_S, torque_nm=TORQUE_NM, angle_rad=ANGLE_RAD, velocity=ANGLE_RAD,
        disturbance_1=TORQUE_NM, disturbance_2=TORQUE_NM,
    )  # fmt: skip
    found = channels_of_table(data, ReadOptions())
    assert set(found.values) == {"torque_nm", "angle_rad"}
    assert [notice.level for notice in found.notices] == ["warning"] * 2


def test_no_recording_is_believed_in_two_units_that_are_confused():
    for (low, high), ratio in ((BELIEVED_SPEED_RAD_S, 180 / np.pi), (BELIEVED_TORQUE_NM, 1e3)):
        assert high / ratio < low


def test_reaction_turns_the_torque_and_its_second_use_is_found():
    whole = {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": ANGLE_RAD}
    found = channels_of_table(
        table(**whole | {"torque_nm": -TORQUE_NM}), ReadOptions(reaction=True)
    )
    np.testing.assert_array_equal(found.values["torque_nm"], TORQUE_NM)
    assert "leave out --reaction" in refusal(table(**whole), reaction=True)[0]


def test_the_user_is_believed_with_a_warning():
    whole = {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": 2 * ANGLE_DEG + 40}
    found = channels_of_table(table(**whole), ReadOptions(units={"angle": "rad"}))
    assert "it is read as the unit that was given says" in found.notices[0].text


def test_an_axis_that_turns_on_is_no_limb():
    whole = {"time_s": TIME_S, "torque_nm": 0.1 * TORQUE_NM, "angle_rad": 2 * TIME_S + ANGLE_RAD}
    assert channels_of_table(table(**whole), ReadOptions()).notices == ()


def test_a_matrix_with_its_labels_is_refused_with_a_way_on():
    """The words of the labels are not offered as the torque."""
    labels = np.array(["Torque", "Angle"], dtype=object)
    found = Table("r.mat", {"labels": labels}, others={"data": "an array of 4000 × 2"})
    (missing,) = refusal(found)[:1]
    assert "save each column of data under a name of its own" in missing
    assert "--column" not in missing


def test_a_time_is_no_candidate_for_the_torque():
    columns = {"time_s": TIME_S, "t_torque [s]": TIME_S, "torque [Nm]": TORQUE_NM}
    assert_si(channels_of_table(table(**columns, angle_rad=ANGLE_RAD), ReadOptions()))


NOISE = np.random.default_rng(7)


@pytest.mark.parametrize(
    ("velocity", "angle"),
    [
        (VELOCITY_RAD_S + NOISE.normal(scale=0.5, size=TIME_S.size), ANGLE_RAD),
        (VELOCITY_RAD_S, np.radians(0.1) * np.round(ANGLE_DEG / 0.1)),
        (np.interp(TIME_S - 0.01, TIME_S, VELOCITY_RAD_S), ANGLE_RAD),
        (np.interp(TIME_S - 0.1, TIME_S, VELOCITY_RAD_S), ANGLE_RAD),
        (VELOCITY_RAD_S + 0.5, np.where(TIME_S < 10.0, ANGLE_RAD, np.nan)),
    ],
    ids=["noise", "steps of an encoder", "late", "too late to judge", "offset, half of the angle"],
)
def test_a_velocity_that_a_sensor_would_give_is_accepted_in_its_unit_alone(velocity, angle):
    whole = {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": angle}
    channels_of_table(table(**whole, velocity_rad_s=velocity), ReadOptions())
    in_degrees = table(**whole, velocity_rad_s=np.degrees(velocity))
    assert "--unit velocity=deg/s" in refusal(in_degrees)[0]
