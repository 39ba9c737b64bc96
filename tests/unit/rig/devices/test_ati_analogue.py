from __future__ import annotations

import math

import numpy as np
import pytest

from rigidimeter.rig.devices import AXES, AtiAnalogue, ReaderError, read_calibration
from rigidimeter.rig.devices.base import DeviceError
from rigidimeter.rig.guard import Cause

RNG = np.random.default_rng(3)
MATRIX = RNG.uniform(-2.0, 2.0, (6, 6))
BIAS = [0.1, -0.2, 0.3, -0.4, 0.5, -0.6]
POUND_N, INCH_M = 4.4482216152605, 0.0254


def cal_text(force="N", torque="N-m", matrix=MATRIX, rows=AXES, serial="FT00001", gain="1"):
    scaled = "".join(
        f'<Axis Name="{name}" values="9 9 9 9 9 9" max="1" scale="9"/>' for name in AXES
    )
    user = "".join(
        f'<UserAxis Name="{name}" values=" {" ".join(map(repr, row.tolist()))} " max="1"/>'
        for name, row in zip(rows, matrix, strict=False)
    )
    return (
        f'<?xml version="1.0" encoding="utf-8"?><!-- a note --><FTSensor Serial="{serial}" '
        f'BodyStyle="Gamma" NumGages="6"><Calibration PartNumber="SI-65-5" ForceUnits="{force}" '
        f'TorqueUnits="{torque}" GainMultiplier="{gain}">{scaled}{user}</Calibration></FTSensor>'
    )


TZ_TWICE = cal_text().replace(
    '<UserAxis Name="Tz"', '<UserAxis Name="Tz" values="1 2 3 4 5 6"/><UserAxis Name="Tz"'
)


class Reader:
    def __init__(self):
        self.ready = [np.array([BIAS])]
        self.stopped = 0

    def start(self):
        return "fake"

    def read(self):
        item = self.ready.pop(0) if self.ready else np.empty((0, 6))
        if isinstance(item, Exception):
            raise item
        return item

    def stop(self):
        self.stopped += 1


class Clock:
    def __init__(self):
        self.now_s = 10.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def made(tmp_path):
    path = tmp_path / "FT00001.cal"
    path.write_text(cal_text())

    def make(**settings):
        values = {"channels": "Dev1/ai0:5", "calibration": str(path), "bias_v": BIAS, "sign": 1}
        reader, clock = Reader(), Clock()
        sensor = AtiAnalogue(AtiAnalogue.Settings(**(values | settings)), clock, reader)
        sensor.connect()
        return sensor, reader, clock

    return make


def test_the_torque_is_the_product_with_the_matrix(made):
    weights = [0.05, 0.0, -0.1, 0.0, 0.2, 1.0]
    sensor, reader, _ = made(weights=weights, sign=-1)
    sensor.configure()
    load = np.array([3.0, -2.0, 5.0, 0.4, -0.3, 0.25])
    volts = np.linalg.solve(MATRIX, load) + BIAS
    reader.ready = [np.vstack((np.zeros(6), volts / 1e3, volts))]
    sample = sensor.read()
    assert sample.torque_nm == pytest.approx(-float(np.dot(weights, load)), abs=1e-12)
    assert (sample.time_s, sample.sequence, sample.cause) == (10.0, 2, 0)
    assert sensor.read() == sample, "nothing new: the one before again"


@pytest.mark.parametrize(
    ("force", "torque", "force_n", "torque_nm"),
    [
        ("N", "N-mm", 1.0, 1e-3),
        ("lbf", "lbf-in", POUND_N, POUND_N * INCH_M),
        ("lb", "lb-ft", POUND_N, POUND_N * 12 * INCH_M),
        ("kN", "kN-m", 1e3, 1e3),
    ],
)
def test_units_of_the_file_become_newton_and_metre(tmp_path, force, torque, force_n, torque_nm):
    path = tmp_path / "a.cal"
    path.write_text(cal_text(force, torque))
    found = read_calibration(path)
    np.testing.assert_allclose(found.matrix[:3], force_n * MATRIX[:3], rtol=1e-12)
    np.testing.assert_allclose(found.matrix[3:], torque_nm * MATRIX[3:], rtol=1e-12)
    assert (found.serial, found.model) == ("FT00001", "Gamma SI-65-5")


def test_rows_are_found_by_name_not_by_place(tmp_path):
    path = tmp_path / "a.cal"
    path.write_text(cal_text(rows=AXES[::-1], matrix=MATRIX[::-1]))
    np.testing.assert_array_equal(read_calibration(path).matrix, MATRIX)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (cal_text(torque="cubit"), "torque unit 'cubit'"),
        (cal_text(force=""), "force unit ''"),
        (TZ_TWICE, "Fx, Fy, Fz, Tx, Ty, Tz, Tz; .* each once"),
        (cal_text(rows=AXES[:5]), "UserAxis rows Fx, Fy, Fz, Tx, Ty;"),
        (cal_text(gain="2"), "GainMultiplier 2"),
        (cal_text(matrix=np.ones((6, 6))), "singular"),
        (cal_text(matrix=MATRIX[:, :5]), "6 rows of 6"),
        (cal_text(matrix=MATRIX * math.nan), "6 rows of 6"),
        ("<Other/>", "<Other>"),
        ("no xml", "not an ATI calibration"),
    ],
)
def test_a_calibration_that_is_none_is_refused(tmp_path, text, message):
    path = tmp_path / "a.cal"
    path.write_text(text)
    with pytest.raises(DeviceError, match=message):
        read_calibration(path)


def test_a_table_in_toml_is_a_calibration_too(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(
        f'serial = "7"\nforce_unit = "N"\ntorque_unit = "Nm"\nmatrix = {MATRIX.tolist()}\n'
    )
    np.testing.assert_array_equal(read_calibration(path).matrix, MATRIX)


def test_the_calibration_of_another_sensor_is_refused(made):
    sensor, _, _ = made(serial="FT99999")
    with pytest.raises(DeviceError, match="FT00001; expected that of FT99999"):
        sensor.configure()


def test_a_saturation_that_is_never_reached_is_refused(made):
    sensor, _, _ = made(range_v=5.0)
    with pytest.raises(DeviceError, match=r"saturation_v = 9\.9"):
        sensor.configure()


def test_saturation_between_two_looks_is_seen(made):
    sensor, reader, _ = made()
    sensor.configure()
    volts = np.zeros((3, 6))
    volts[1, 4] = -9.95
    reader.ready = [volts]
    assert sensor.read().cause == Cause.TORQUE_SATURATED


def test_voltages_the_same_to_the_bit_are_frozen(made):
    sensor, reader, clock = made()
    sensor.configure()
    causes = []
    for change in (0.0, 0.0, 0.0, 0.0, 1e-12, 0.0):
        reader.ready = [np.array([BIAS]) + change]
        causes.append(sensor.read().cause)
        clock.now_s += 0.02
    assert causes == [0, 0, 0, Cause.TORQUE_FROZEN, 0, 0]
    assert sensor.counts["repeated"] == 3


def test_a_number_that_is_not_finite_goes_on_to_the_guard(made):
    sensor, reader, _ = made()
    sensor.configure()
    reader.ready = [np.full((1, 6), math.nan)]
    sample = sensor.read()
    assert math.isnan(sample.torque_nm)
    assert sample.cause == 0


def test_a_reader_that_fails_is_named_not_raised(made):
    sensor, reader, _ = made()
    sensor.configure()
    reader.ready = [ReaderError("open wire")]
    assert sensor.read().cause == Cause.TORQUE_STATUS
    assert sensor.counts["damaged"] == 1


def test_without_the_library_the_sentence_says_how_to_get_it(made):
    try:
        import nidaqmx  # noqa: F401
    except ImportError:
        sensor = AtiAnalogue(
            AtiAnalogue.Settings(channels="Dev1/ai0:5", calibration="a.cal"), Clock()
        )
        with pytest.raises(DeviceError, match=r"pip install 'rigidimeter\[nidaq\]'"):
            sensor.connect()
