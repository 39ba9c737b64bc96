"""Units as people write them, and the conversions of a column, against closed forms."""

import math

import numpy as np
import pytest

from rigidimeter.analysis.reading.channels.conversion import conversion
from rigidimeter.analysis.reading.channels.headers import read_header
from rigidimeter.analysis.reading.channels.unit_text import expression, factor
from rigidimeter.core.errors import UserError

DEGREE = math.pi / 180


@pytest.mark.parametrize(
    ("text", "standard", "expected"),
    [
        ("deg", "angle_rad", DEGREE), ("°", "angle_rad", DEGREE), ("Grad", "angle_rad", DEGREE),
        ("gradi", "angle_rad", DEGREE), ("degrés", "angle_rad", DEGREE), ("rad", "angle_rad", 1.0),
        ("mrad", "angle_rad", 1e-3), ("gon", "angle_rad", math.pi / 200),
        ("°/s", "velocity_rad_s", DEGREE), ("deg s^-1", "velocity_rad_s", DEGREE),
        ("rpm", "velocity_rad_s", math.pi / 30), ("U/min", "velocity_rad_s", math.pi / 30),
        ("Nm", "torque_nm", 1.0), ("N.m", "torque_nm", 1.0), ("N·m", "torque_nm", 1.0),
        ("Nmm", "torque_nm", 1e-3), ("mNm", "torque_nm", 1e-3), ("N*cm", "torque_nm", 1e-2),
        ("ft-lb", "torque_nm", 0.3048 * 4.4482216152605), ("kgf·cm", "torque_nm", 0.0980665),
        ("ms", "time_s", 1e-3), ("Sek", "time_s", 1.0), ("days", "time_s", 86400.0),
        ("µs", "time_s", 1e-6), ("mV", "emg_v", 1e-3), ("μV", "emg_v", 1e-6),
    ],
)  # fmt: skip
def test_a_unit_is_this_much(text, standard, expected):
    assert factor(text, standard) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "standard"),
    [
        ("mm", "angle_rad"), ("V", "torque_nm"), ("J", "torque_nm"), ("1/s", "velocity_rad_s"),
        ("Hz", "velocity_rad_s"), ("Nm/rad", "torque_nm"), ("rad/s", "angle_rad"),
        ("deg", "time_s"), ("grad", "angle_rad"), ("%", "torque_nm"), ("", "angle_rad"),
        ("deg**9**9", "angle_rad"), ("x" * 200, "angle_rad"), ("__import__", "angle_rad"),
    ],
)  # fmt: skip
def test_what_is_not_a_unit_of_the_quantity(text, standard):
    assert factor(text, standard) is None


def test_degrees_in_german_and_gons_in_french_are_not_told_apart():
    assert expression("grad") == ""


@pytest.mark.parametrize(
    ("name", "kind", "unit"),
    [
        ("angle [deg]", "angle", "deg"), ("Angle (°)", "angle", "°"), ("t / ms", "time", "ms"),
        ("Torque_Nm", "torque", "Nm"), ("Zeit [ms]", "time", "ms"), ("Winkel [°]", "angle", "°"),
        ("Ellbogenwinkel, Grad", "angle", "Grad"), ("F (N)", "force", "N"),
        ("couple (N.m)", "torque", "N.m"), ("vitesse angulaire (deg/s)", "velocity", "deg/s"),
        ("Velocità angolare [rad/s]", "velocity", "rad/s"), ("Par (N·m)", "torque", "N·m"),
        ("Ángulo (grados)", "angle", "grados"), ("Störmoment [mNm]", "perturbation", "mNm"),
        ("φ [°]", "angle", "°"), ("omega_rad_s", "velocity", "rad_s"), ("Zeit in s", "time", "s"),
        ("data.torque_Nm", "torque", "Nm"), ("Torque X [Nm]", "torque", "Nm"),
        ("EMG biceps [mV]", "emg", "mV"), ("Speed (rpm)", "velocity", "rpm"),
        ("torque", "torque", ""), ("torque_m", "torque", ""), ("angle (grad)", "angle", ""),
        ("Angle (0.1 deg)", "angle", ""), ("Angle 0,1 deg", "angle", ""),
        ("Angle in 1/10 deg", "angle", ""), ("Time (10 ms)", "time", ""),
        ("Angle*10 [deg]", "angle", ""),
        ("Angle x10 deg", "angle", ""), ("100 x Torque (Nm)", "torque", ""),
        ("Torque 1e-3 Nm", "torque", ""), ("Angle/10 [deg]", "angle", ""),
        ("Torque 10 [Nm]", "torque", "Nm"), ("Index 2 angle_deg", "angle", "deg"),
        ("dev/10/angle_deg", "angle", "deg"),
        ("Torque Error [Nm]", "", "Nm"), ("torque command [Nm]", "", "Nm"), ("Sample", "", ""),
    ],
)  # fmt: skip
def test_what_a_header_says(name, kind, unit):
    found = read_header(name)
    assert (found.kind, found.unit) == (kind, unit)


def test_a_name_and_a_row_of_units_that_disagree():
    assert read_header("angle_deg", "rad").stated_twice == "deg"
    assert read_header("angle [deg]", "°").stated_twice == ""
    assert read_header("Torque", "N-m").unit == "N-m"


def test_a_unit_of_the_file_that_is_not_known_contradicts_the_name():
    assert read_header("torque_nm", "Nm/kg").stated_twice == "nm"
    assert read_header("angle_deg", "0.1 deg").stated_twice == "deg"
    for nothing in ("", "-", "n/a", "a.u.", "None", "1", "dimensionless", "unknown"):
        assert read_header("angle_deg", nothing).stated_twice == ""
    assert read_header("torque", "Nm/kg").unit == ""


@pytest.mark.parametrize(
    ("unit", "scale", "offset", "raw", "expected"),
    [
        ("V", "2.5 Nm/V", "0.1 V", 0.5, 1.0),
        ("mV", "2.5 Nm/V", "100 mV", 500.0, 1.0),
        ("mV", "2.5 Nm/V", "0.1 V", 500.0, 1.0),
        ("", "2.5 Nm/V", "0.1", 0.5, 1.0),
        ("V", "2.5 Nm/V", "0.25 Nm", 0.5, 1.0),
        ("N", "0.25 m", "", 4.0, 1.0),
        ("N", "25 cm", "", 4.0, 1.0),
        ("Nmm", "-1", "", 500.0, -0.5),
        ("mV/V", "0.5 Nm/(mV/V)", "", 2.0, 1.0),
        ("", "0.5 Nm/(mV/V)", "", 2.0, 1.0),
        ("A", "0.62 Nm/A", "", 2.0, 1.24),
        ("mA", "0.62 Nm/A", "", 2000.0, 1.24),
        ("%", "0.03 Nm/%", "", 50.0, 1.5),
        ("bar", "0.4 Nm/bar", "", 2.0, 0.8),
        ("raw", "0.001 Nm", "", 500.0, 0.5),
        ("Nm", "0.62", "", 2.0, 1.24),
    ],
)
def test_scale_and_offset(unit, scale, offset, raw, expected):
    found = conversion("torque_nm", "T", unit, scale, offset)
    assert found(np.array([raw]))[0] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "scale", "offset", "told"),
    [
        ("N", "", "", "say the lever arm, as in --scale 'torque=NUMBER m'"),
        ("V", "", "", "say --scale 'torque=NUMBER Nm/V'"),
        ("mV/V", "", "", r"say --scale 'torque=NUMBER Nm/\(mV/V\)'"),
        ("mV/V", "0.5 Nm", "", "does not make Nm"),  # of 1 mV/V, or of its unit 0.001?
        ("%", "2.5 Nm", "", "does not make Nm"),  # of 1 %, or of 100?
        ("A", "2.5", "", "does not make Nm"),
        ("Nm", "2.5 Nm/V", "", "does not make Nm"),
        ("V", "0 Nm/V", "", "must not be 0"),
        ("V", "fast", "", "does not make Nm"),
        ("V", "2.5 Nm/V", "3 deg", "what column 'T' reads at zero"),
        ("furlong", "", "", "unknown unit 'furlong'"),
    ],
)
def test_what_does_not_make_a_torque_is_refused(unit, scale, offset, told):
    with pytest.raises(UserError, match=told):
        conversion("torque_nm", "T", unit, scale, offset)


def test_a_velocity_is_scaled_by_its_own_unit():
    """The "/s" of rad/s is no column in seconds."""
    assert conversion("velocity_rad_s", "speed", "", "0.25 rad/s", "").factor == 0.25
    assert conversion("velocity_rad_s", "speed", "raw", "0.25 rad/s", "").factor == 0.25
    per_volt = conversion("velocity_rad_s", "speed", "", "20 deg/s/V", "")
    assert per_volt.factor == pytest.approx(np.radians(20.0))


def test_what_brackets_hold_and_no_table_knows_is_named():
    header = read_header("Torque [furlong]")
    assert (header.kind, header.unit, header.in_brackets) == ("torque", "", "furlong")
    assert read_header("Torque [A]").unit == "A"
