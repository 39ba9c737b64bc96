"""Units as people write them: each spelling in SI, factors, offsets, and what is no unit."""

from __future__ import annotations

import math

import numpy as np
import pytest

from rigidimeter.analysis.reading_anew import Column, Columns, Mapping, mapping_of, verdict

N = 400
TIME_S = np.arange(N) / 50.0
VALUES = np.random.default_rng(1).normal(size=N)


def first(head: str, unit: str = "", **said: object) -> float:
    """Return what 1 of a column becomes, of the quantity that its name says."""
    columns = {
        "time_s": Column.of(TIME_S),
        head: Column.of(VALUES, unit),
        "torque_nm": Column.of(VALUES),
        "angle_rad": Column.of(VALUES),
    }
    if "orque" in head:
        del columns["torque_nm"]
    if "ngle" in head:
        del columns["angle_rad"]
    found = verdict(Columns("r", columns), mapping_of(**said)).found.chosen
    (name,) = [name for name, column in found.columns.items() if column == head]
    return found.to_si[name].size


@pytest.mark.parametrize(
    ("head", "size"),
    [
        ("Torque [Nm]", 1.0),
        ("torque_Nmm", 1e-3),
        ("Torque (N·mm)", 1e-3),
        ("Torque [N.mm]", 1e-3),
        ("Torque [mm.N]", 1e-3),
        ("Torque (ft-lb)", 1.3558179483314004),
        ("Torque [in-lb]", 0.1129848290276167),
        ("Torque (kgf·cm)", 0.0980665),
        ("Torque / mNm", 1e-3),
        ("Torque [Newton_Meters]", 1.0),
        ("Angle [deg]", math.pi / 180),
        ("Angle (°)", math.pi / 180),
        ("Angle, Grad", math.pi / 180),
        ("Angle [mrad]", 1e-3),
        ("Angle [rev]", 2 * math.pi),
        ("Angle [gon]", math.pi / 200),
        ("Angle (arcmin)", math.pi / 10800),
        ("Velocity [deg/s]", math.pi / 180),
        ("Velocity (rpm)", 2 * math.pi / 60),
        ("Velocity [rev/min]", 2 * math.pi / 60),
        ("speed_rad_s", 1.0),
        ("Velocity [dps]", math.pi / 180),
        ("Velocity [deg per s]", math.pi / 180),
        ("Velocity [deg·s^-1]", math.pi / 180),
    ],
)
def test_a_unit_in_a_name(head: str, size: float) -> None:
    assert first(head) == pytest.approx(size, rel=1e-14)


def test_the_unit_beside_a_name() -> None:
    assert first("Torque", "mNm") == 1e-3
    assert first("Torque [Nm]", "N*m") == 1.0


@pytest.mark.parametrize(
    ("head", "scale", "size"),
    [
        ("Torque [V]", "2.5 Nm/V", 2.5),
        ("Torque [mV]", "2.5 Nm/V", 2.5e-3),
        ("Torque [N]", "0.2 m", 0.2),
        ("Torque [lb]", "0.2 m", 0.88964432305210),
        ("Torque [counts]", "1e-3 Nm", 1e-3),
        ("Torque [counts]", "1e-3 Nm/count", 1e-3),
        ("Torque [mV/V]", "0.5 Nm/(mV/V)", 0.5),
        ("Torque [%]", "0.5 Nm/%", 0.5),
        ("Torque [A]", "0,62 Nm/A", 0.62),
        ("Torque", "0.001 Nm", 1e-3),
        ("Torque [Nm]", "-1", -1.0),
        ("Torque [Nm]", "2 Nm/Nm", 2.0),
        ("Torque [Nm]", "2 mNm/Nm", 2e-3),
    ],
)
def test_a_factor(head: str, scale: str, size: float) -> None:
    assert first(head, scale={"torque": scale}) == pytest.approx(size, rel=1e-13)


def sentences(head: str, **said: object) -> str:
    columns = {"time_s": TIME_S, head: VALUES, "angle_rad": VALUES}
    file = Columns("r", {name: Column.of(values) for name, values in columns.items()})
    return "\n".join(verdict(file, mapping_of(**said)).sentences)


@pytest.mark.parametrize(
    ("head", "said", "sentence"),
    [
        ("Torque [N]", {}, "say the lever arm, as in --scale 'torque=NUMBER m'"),
        ("Torque [V]", {}, "say --scale 'torque=NUMBER Nm/V'"),
        ("Torque [mV/V]", {"scale": {"torque": "0.5 Nm"}}, "NUMBER Nm/(mV/V)"),
        ("Torque [%]", {"scale": {"torque": "0.5 Nm"}}, "does not make Nm"),
        ("Torque [mm]", {"scale": {"torque": "2 Nm/V"}}, "does not make Nm"),
        ("Torque [Nm]", {"scale": {"torque": "0 Nm/Nm"}}, "must not be 0"),
        ("Torque", {"unit": {"torque": "parsec"}}, "unknown unit 'parsec'"),
        ("Torque", {"unit": {"torque": "deg"}}, "is in deg, and torque is needed in Nm"),
        ("Torque [xyz]", {}, "'xyz' in 'Torque [xyz]' is no unit that is known"),
        ("Torque", {"unit": {"torque": "Nm"}, "offset": {"torque": "1 V"}}, "reads at zero"),
    ],
)
def test_what_does_not_make_a_torque(head: str, said: dict[str, object], sentence: str) -> None:
    assert sentence in sentences(head, **said)


@pytest.mark.parametrize(("offset", "own"), [("0.1 V", 100.0), ("100", 100.0), ("0.25 Nm", 100.0)])
def test_an_offset_is_what_the_column_reads_at_zero(offset: str, own: float) -> None:
    said = mapping_of(scale={"torque": "2.5 Nm/V"}, offset={"torque": offset})
    columns = {"time_s": TIME_S, "Torque [mV]": VALUES, "angle_rad": VALUES}
    file = Columns("r", {name: Column.of(values) for name, values in columns.items()})
    found = verdict(file, said).found.chosen.to_si["torque"]
    assert (found.size, found.offset) == pytest.approx((2.5e-3, own))


@pytest.mark.parametrize("head", ["angle (grad)", "Angle (0.1 deg)", "Angle*10 [deg]", "angle"])
def test_what_may_mean_two_things_is_asked(head: str) -> None:
    columns = {"time_s": TIME_S, "torque_nm": VALUES, head: VALUES}
    file = Columns("r", {name: Column.of(values) for name, values in columns.items()})
    (question, *_) = verdict(file, Mapping()).sentences
    assert f"the unit of {head!r} is stated nowhere" in question
