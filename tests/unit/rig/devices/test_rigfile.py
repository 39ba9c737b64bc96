"""RIG.toml: what its devices are, and where its joint must stand."""

from __future__ import annotations

import math

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.rig.devices import Home, load_rig

DEVICES = """
[torque_sensor]
driver = "ati-rdt"
address = "127.0.0.1"
[drive]
driver = "ascii"
port = "/dev/no-such"
counts_per_turn = 1000
"""


@pytest.fixture
def rig_file(tmp_path):
    def write(text: str):
        path = tmp_path / "rig.toml"
        path.write_text(text + DEVICES)
        return path

    return write


def test_without_a_home_the_joint_may_stand_anywhere(rig_file):
    assert load_rig(rig_file("")).home is None


def test_the_home_is_in_degrees(rig_file):
    home = load_rig(rig_file("home_deg = -90\nhome_tolerance_deg = 1.5\n")).home
    assert home is not None
    assert home.angle_rad == -math.pi / 2
    assert home.tolerance_rad == pytest.approx(math.radians(1.5))
    assert load_rig(rig_file("home_deg = 0.0\n")).home == Home(0.0, math.radians(3.0))


@pytest.mark.parametrize("line", ['home_deg = "up"', "home_deg = true", "home_tolerance_deg = []"])
def test_a_home_that_is_no_number_is_refused(rig_file, line):
    with pytest.raises(UserError, match=r"home_\w+ must be a number of degrees"):
        load_rig(rig_file(f"{line}\n"))


def test_a_session_that_is_gone_on_with_brings_its_own_home(rig_file):
    rig = load_rig(rig_file("home_deg = 10.0\n"))
    begun = Home(0.3, 0.05)
    assert rig.build(lambda: 0.0, 50.0, begun)._home == begun
    assert rig.build(lambda: 0.0, 50.0)._home == rig.home


@pytest.mark.parametrize(
    "lines",
    [
        "home_deg = nan",
        "home_deg = inf",
        "home_deg = 0.0\nhome_tolerance_deg = -3.0",
        "home_deg = 0.0\nhome_tolerance_deg = 0",
        "home_deg = 0.0\nhome_tolerance_deg = inf",
        "home_deg = 0.0\nhome_tolerance_deg = 360",
    ],
)
def test_a_home_that_no_joint_or_every_joint_meets_is_refused(rig_file, lines):
    with pytest.raises(
        UserError, match=r"home_\w+ must be (a finite number of|above 0 and at most)"
    ):
        load_rig(rig_file(f"{lines}\n"))


SENSOR = """
from rigidimeter.core.settings.section import Section
class Sensor:
    Settings = {settings}
    def connect(self): ...
    def configure(self): ...
    def read(self): ...
    def close(self): ...
    counts = {{}}
"""


DRIVE = (
    SENSOR.format(settings="Section")
    + "    enable = write = stop = disable = watchdog_s = read\n"
    + "    def __init__(self): ...\n"
)


@pytest.mark.parametrize(
    ("source", "words"),
    [
        ("raise RuntimeError('no such card')", "its module fails with RuntimeError: no such card"),
        ("def (", "its module fails with SyntaxError"),
        ("raise SystemExit(3)", "its module fails with SystemExit: 3"),
        ("import no_such_thing", r"cannot be loaded \(No module named 'no_such_thing'\)"),
        (SENSOR.format(settings=3), "its Settings must be a class derived from"),
        (SENSOR.format(settings="Section"), "is no driver for a drive: it has no enable, write"),
        (DRIVE, r"must be made with \(settings, now\), but too many positional arguments"),
    ],
)
def test_a_driver_of_another_s_that_is_none_is_refused(tmp_path, monkeypatch, source, words):
    module = f"driver_{abs(hash(source))}"
    (tmp_path / f"{module}.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    path = tmp_path / "rig.toml"
    path.write_text(
        '[torque_sensor]\ndriver = "ati-rdt"\naddress = "127.0.0.1"\n'
        f'[drive]\ndriver = "{module}:Sensor"\n'
    )
    with pytest.raises(UserError, match=words):
        load_rig(path)


@pytest.mark.parametrize("driver", [":Drive", ".near:Drive", "near:", "near"])
def test_a_driver_that_names_no_module_is_refused(tmp_path, driver):
    path = tmp_path / "rig.toml"
    path.write_text(
        '[torque_sensor]\ndriver = "ati-rdt"\naddress = "127.0.0.1"\n'
        f'[drive]\ndriver = "{driver}"\n'
    )
    with pytest.raises(UserError, match=r"there is no driver .*; known are cia402, ascii"):
        load_rig(path)


def can_rig(tmp_path, lines):
    path = tmp_path / "rig.toml"
    path.write_text(f'[torque_sensor]\ndriver = "ati-rdt"\n[drive]\ndriver = "cia402"\n{lines}\n')
    return path


@pytest.mark.parametrize(("channel", "is_"), [("0", 0), ('"can1"', "can1"), ('"0"', "0")])
def test_a_channel_is_a_text_or_a_number(tmp_path, channel, is_):
    rig = load_rig(can_rig(tmp_path, f'interface = "kvaser"\nchannel = {channel}'))
    assert rig.devices["drive"][1].channel == is_
    assert not rig.emulated


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        ("interface = 5", r"interface = 5: Input should be a valid string"),
        ('interface = ""', r"interface = '': String should have at least 1 character"),
        ("channel = -1", r"channel: -1 names no channel; it must be a text such as \"can0\", or a"),
        ("channel = true", r"channel: True names no channel"),
        ('channel = ""', r"channel: '' names no channel"),
        ("channel = [0]", r"channel: \[0\] names no channel"),
    ],
)
def test_another_interface_or_channel_is_refused_with_a_sentence(tmp_path, lines, words):
    path = can_rig(tmp_path, lines)
    with pytest.raises(UserError, match=rf"rig\.toml, \[drive\]: {words}"):
        load_rig(path)


@pytest.mark.parametrize(
    ("driver", "line", "words"),
    [
        ("ascii", "port = 5", "port = 5: Input should be a valid string"),
        ("ascii", "lost_s = 0.2", "port is missing: Field required"),
        ("ascii", 'port = "/dev/x"\nexternal_watchdog = 1', "1: Input should be a valid boolean"),
    ],
)
def test_a_value_of_another_kind_is_refused_with_a_sentence(tmp_path, driver, line, words):
    path = tmp_path / "rig.toml"
    path.write_text(
        f'[torque_sensor]\ndriver = "ati-rdt"\n[drive]\ndriver = "{driver}"\n'
        f"counts_per_turn = 1000\n{line}\n"
    )
    with pytest.raises(UserError, match=words):
        load_rig(path)
