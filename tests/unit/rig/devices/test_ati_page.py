"""What the sensor's own page says of it: units, counts, rate, and what has changed."""

import pytest

from rigidimeter.rig.devices import FORCE_UNITS_N, TORQUE_UNITS_NM, page_changes, parse_page
from rigidimeter.rig.devices.base import DeviceError

PAGE = {
    "prodname": "Net F/T",
    "runstat": "0x00000000",
    "setcfgsel": "0",
    "cfgcalsel": "2",
    "cfgcalsn": "FT27462",
    "scfgfu": "N",
    "scfgtu": "Nm",
    "cfgcpf": "1000000",
    "cfgcpt": "1000000",
    "comrdte": "Enabled",
    "runrate": "7000",
    "comrdtrate": "1000",
    "setbias": "745;17;447;184;-596;-253",
}


def page(**changed):
    values = {tag: value for tag, value in {**PAGE, **changed}.items() if value is not None}
    body = "".join(f"<{tag}>{value}</{tag}>" for tag, value in values.items())
    return parse_page(f"<netft>{body}</netft>".encode(), "torque sensor")


@pytest.mark.parametrize(
    ("unit", "newton_metres"),
    [
        ("Nm", 1.0),
        ("N-m", 1.0),
        ("Nmm", 1e-3),
        ("kNm", 1e3),
        ("lbf-in", 0.45359237 * 9.80665 * 0.0254),
        ("lbf-ft", 0.45359237 * 9.80665 * 0.3048),
        ("kg-cm", 9.80665 * 0.01),
    ],
)
def test_a_count_weighs_the_unit_by_the_counts_per_unit(unit, newton_metres):
    weight = page(scfgtu=unit, cfgcpt="250000").newton_metre_per_count
    assert weight == pytest.approx(newton_metres / 250000, rel=1e-12)


@pytest.mark.parametrize(
    ("unit", "newtons"), [("N", 1.0), ("kN", 1e3), ("lbf", 0.45359237 * 9.80665), ("kgf", 9.80665)]
)
def test_so_does_a_count_of_force(unit, newtons):
    weight = page(scfgfu=unit, cfgcpf="1000").newton_per_count
    assert weight == pytest.approx(newtons / 1000, rel=1e-12)


@pytest.mark.parametrize(
    ("shown", "internal", "exact_hz"),
    [("1000", "7000", 1000.0), ("2333", "7000", 7000 / 3), ("2000", "7000", 2000.0),
     ("333", None, 333.0), ("1", "7000", 1.0)],
)  # fmt: skip
def test_a_rounded_rate_is_taken_as_the_sensor_divides_its_own(shown, internal, exact_hz):
    assert page(comrdtrate=shown, runrate=internal).sample_rate_hz == pytest.approx(exact_hz)


def test_known_units_are_positive_numbers():
    assert all(value > 0 for value in [*FORCE_UNITS_N.values(), *TORQUE_UNITS_NM.values()])


@pytest.mark.parametrize(
    ("tag", "value"),
    [
        ("scfgtu", "cubit-stone"),
        ("scfgtu", None),
        ("scfgfu", "dyn"),
        ("cfgcpt", "0"),
        ("cfgcpt", "-1"),
        ("cfgcpt", "nan"),
        ("cfgcpf", "many"),
        ("cfgcpf", None),
        ("comrdtrate", None),
        ("runrate", "0"),
        ("cfgcalsel", "two"),
        ("cfgcalsel", "-1"),
        ("runstat", "-1"),
        ("runstat", "-0x1"),
        ("runstat", "0x100000000"),
        ("comrdte", "Disabled"),
    ],
)
def test_a_page_that_does_not_do_is_refused_by_the_name_of_the_field(tag, value):
    with pytest.raises(DeviceError, match=tag) as refused:
        page(**{tag: value})
    assert "torque sensor" in str(refused.value)
    assert value is None or value in str(refused.value)


def test_something_else_than_the_page_is_refused():
    with pytest.raises(DeviceError, match="not the page of a Net F/T"):
        parse_page(b"<html><br></html>", "torque sensor")


def test_every_change_is_named_but_the_status():
    before = page()
    assert page_changes(before, page(runstat="0x80010000")) == ""
    assert page_changes(before, page(scfgtu="lbf-in", cfgcalsn="FT1")) == (
        "torque_unit 'Nm' became 'lbf-in', serial 'FT27462' became 'FT1'"
    )
    assert "bias" in page_changes(before, page(setbias="0;0;0;0;0;0"))


@pytest.mark.parametrize("tag", ["cfgcpt", "scfgtu", "runstat", "cfgcalsn", "setuserfilter"])
@pytest.mark.parametrize("again", ["another", "the same"])
def test_a_page_that_says_one_thing_twice_is_refused(tag, again):
    """Which of two would be the torque's is not known; nor whose page it is."""
    values = {"setuserfilter": "0", **PAGE}
    body = "".join(f"<{name}>{value}</{name}>" for name, value in values.items())
    second = values[tag] if again == "the same" else "12345"
    text = f"<netft>{body}<more><{tag}>{second}</{tag}></more></netft>".encode()
    with pytest.raises(DeviceError, match=f"torque sensor: {tag} is in /netftapi2.xml twice"):
        parse_page(text, "torque sensor")
