"""Which columns are taken, in what unit; and what is refused, on a joint of known J, B and K."""

import numpy as np
import pytest
from tests.known_joint import TRUTH, angle_rad, torque_nm

from rigidimeter.analysis.reading.channels.channels_of_table import channels_of_table
from rigidimeter.analysis.reading.channels.looks import look
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


@pytest.mark.parametrize(
    ("columns", "options"),
    [
        ({"Zeit [ms]": 1e3 * TIME_S, "Drehmoment [Nm]": TORQUE_NM, "Winkel [°]": ANGLE_DEG}, {}),
        ({"t (s)": TIME_S, "F (N)": TORQUE_NM / 0.25, "angle_deg": ANGLE_DEG},
         {"scales": {"torque": "0.25 m"}}),
        ({"t (s)": TIME_S, "Torque (V)": TORQUE_NM / 2.5 + 0.1, "angle_deg": ANGLE_DEG},
         {"scales": {"torque": "2.5 Nm/V"}, "offsets": {"torque": "0.1 V"}}),
        ({"time": TIME_S, "torque": TORQUE_NM, "angle": ANGLE_DEG},
         {"units": {"time": "s", "torque": "Nm", "angle_rad": "deg"}}),
        ({"time_s": TIME_S, "torque_nm": TORQUE_NM, "theta": ANGLE_RAD, "Angle": ANGLE_DEG},
         {"columns": {"angle_rad": "theta"}}),
    ],
)  # fmt: skip
def test_units_are_converted(columns, options):
    assert_si(channels_of_table(table(**columns), ReadOptions(**options)))


def test_a_row_of_units():
    units = {"Time": "s", "Torque": "N·mm", "Angle": "deg"}
    data = table(units, Time=TIME_S, Torque=1e3 * TORQUE_NM, Angle=ANGLE_DEG)
    assert_si(channels_of_table(data, ReadOptions()))


def test_our_own_names_are_not_touched():
    found = channels_of_table(
        table(time_s=TIME_S, torque_nm=TORQUE_NM, angle_rad=ANGLE_RAD, Angle=ANGLE_DEG),
        ReadOptions(),
    )
    assert found.values["angle_rad"] is ANGLE_RAD
    assert found.notices == ()


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
    assert "--unit angle=furlong: is not a unit that is known" in text


def test_two_candidates_are_not_chosen_from():
    data = table(time_s=TIME_S, angle_rad=ANGLE_RAD, **{"M1 [Nm]": TORQUE_NM, "M2 [Nm]": TORQUE_NM})
    (line,) = refusal(data)
    assert "--column 'torque=M1 [Nm]' or --column 'torque=M2 [Nm]'" in line


def test_what_is_optional_and_in_doubt_is_not_used_and_said():
    data = table(
        time_s=TIME_S, torque_nm=TORQUE_NM, angle_rad=ANGLE_RAD, velocity=ANGLE_RAD,
        disturbance_1=TORQUE_NM, disturbance_2=TORQUE_NM,
    )  # fmt: skip
    found = channels_of_table(data, ReadOptions())
    assert set(found.values) == {"torque_nm", "angle_rad"}
    assert [notice.level for notice in found.notices] == ["warning"] * 2


@pytest.mark.parametrize(
    ("columns", "told"),
    [
        ({"angle_rad": 10 * ANGLE_DEG}, "'angle_rad' is in rad, but an angle of"),
        ({"angle_rad": ANGLE_DEG * 2 + 40}, "is more than one turn; say --unit angle=rad or"),
        ({"time_s": 1e3 * TIME_S}, "'time_s' is in s, but 0.2 samples/s and a motion of 0.00"),
        ({"time_s": TIME_S * 100}, "are too slow"),
        ({"torque_nm": -TORQUE_NM}, "has the sign of the joint's reaction, or the angle is rev"),
        ({"angle_rad": -ANGLE_RAD}, "has the sign of the joint's reaction"),
        ({"torque_nm": ANGLE_RAD, "angle_rad": TORQUE_NM}, "'torque_nm' and 'angle_rad' are "
         "exchanged"),
        ({"torque_nm": 1e4 * TORQUE_NM}, "is too large"),
    ],
)  # fmt: skip
def test_a_stated_unit_sign_or_name_that_cannot_be_is_found(columns, told):
    whole = {"time_s": TIME_S, "torque_nm": TORQUE_NM, "angle_rad": ANGLE_RAD} | columns
    assert told in refusal(table(**whole))[0]


@pytest.mark.parametrize(
    ("column", "other", "to_si"),
    [
        ("angle [deg]", "rad", 1.0),
        ("angle [rad]", "deg", np.pi / 180),
        ("Torque (N·mm)", "Nm", 1.0),
        ("Torque (Nm)", "Nmm", 1e-3),
    ],
)
@pytest.mark.parametrize("size", [0.3, 1.0, 3.0])
def test_a_unit_that_is_confused_with_another_is_refused_unless_the_user_insists(
    column, other, to_si, size
):
    """Whatever the motion and the joint: J, B and K alone are those of one joint or another."""
    right = {"torque_nm": TORQUE_NM, "angle_rad": ANGLE_RAD}
    standard = "angle_rad" if "angle" in column else "torque_nm"
    si = size * right.pop(standard)
    data = table(time_s=TIME_S, **right, **{column: si / to_si})
    lines = refusal(data)
    name, stated = standard.split("_")[0], column.split("[")[-1].split("(")[-1][:-1]
    assert f"is in {stated}, but" in lines[0]
    assert f"--unit {name}={other}" in lines[0]
    assert len(lines) == 3  # and a line for each reading
    found = channels_of_table(data, ReadOptions(units={name: other}))
    np.testing.assert_allclose(found.values[standard], si, rtol=1e-12)
    channels_of_table(data, ReadOptions(units={name: stated}))


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


def test_the_rough_fit_is_the_joint():
    fit = look((TIME_S, TORQUE_NM), (TIME_S, ANGLE_RAD), is_angle=True).fit
    np.testing.assert_allclose(fit.value, TRUTH, rtol=0.05)


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
