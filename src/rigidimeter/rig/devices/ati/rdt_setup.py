"""Settings of an ATI Net F/T, and the XML page /netftapi2.xml that reports its configuration.

A torque is counts / (counts per unit), in the sensor's unit. Both depend on the active
configuration, which anybody can change on the sensor, so they are read and never assumed.
"""

from __future__ import annotations

import http.client
import math
import socket
import xml.etree.ElementTree as ElementTree
from dataclasses import asdict, dataclass
from typing import Literal, Self

from pydantic import Field, model_validator

from rigidimeter.core.settings import Section, quantity
from rigidimeter.rig.devices.ati.calibration import FORCE_UNITS_N, TORQUE_UNITS_NM, unit_name
from rigidimeter.rig.devices.ati.rdt_packets import status_cause, status_words
from rigidimeter.rig.devices.base import DeviceError, Now

LARGEST_PAGE_BYTES = 65536
LARGEST_INTEGER = 0xFFFFFFFF
"""Of a status word and of an index."""


class AtiRdtSettings(Section):
    """Address, mounting and expected configuration of the sensor.

    The expected values are compared with what the sensor reports; an empty text, 0, or -1 for the
    calibration index is not compared.

    `clock_drift_ppm` is how fast the sensor's clock may part from the computer's. Samples that come
    ever later, by more than that, are found to be old. Two crystals part by up to 200 ppm, and a
    computer that sets its clock by the network's corrects it by up to 500 ppm.
    """

    address: str = Field("192.168.1.1", min_length=1, max_length=253)
    port: int = quantity(49152, "1", 1, 65535)
    http_port: int = quantity(80, "1", 1, 65535)
    timeout_s: float = quantity(1.0, "s", 0.01, 30.0)
    weights: list[float] = Field(
        [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
        min_length=6,
        max_length=6,
        json_schema_extra={"unit": "m for the forces, 1 for the torques"},
    )
    sign: Literal[1, -1] = -1
    expected_serial: str = Field("", max_length=64)
    expected_calibration: int = quantity(-1, "1", -1, 255)
    expected_force_unit: str = Field("", max_length=16)
    expected_torque_unit: str = Field("", max_length=16)
    expected_rate_hz: float = quantity(0.0, "Hz", 0.0, 10000.0)
    tolerated_packets: int = quantity(5, "1", 0, 10000)
    packet_window_s: float = quantity(1.0, "s", 0.001, 60.0)
    frozen_s: float = quantity(0.05, "s", 0.001, 10.0)
    clock_drift_ppm: float = quantity(700.0, "ppm", 1.0, 100_000.0)

    @property
    def emulated(self) -> bool:
        """Whether the address is this computer, so that there is no hardware."""
        return self.address == "localhost" or self.address.startswith("127.")

    @property
    def lock_names(self) -> tuple[str, ...]:
        """What the sensor is, in whatever rig file."""
        try:
            address = socket.gethostbyname(self.address)
        except (OSError, UnicodeError):  # connecting says so
            address = self.address
        return (f"torque sensor at {address}:{self.port}",)

    @model_validator(mode="after")
    def _some_weight(self) -> Self:
        if not any(self.weights):
            raise ValueError("weights are all zero; at least one axis must count")
        return self


@dataclass(frozen=True)
class SensorPage:
    """The configuration that the torque depends on; a sensor whose page differs is another one.

    Parameters
    ----------
    counts_per_force, counts_per_torque : float
        Per unit of the sensor.
    force_unit, torque_unit : str
        As in `FORCE_UNITS_N` and `TORQUE_UNITS_NM`.
    rate_hz : float
        Rate of the records.
    serial : str
        Of the calibrated transducer.
    calibration, configuration : int
        The active ones among those stored in the sensor; -1 if not reported.
    transform, bias, low_pass : str
        The tool transformation, the software bias in counts, and the filter, as reported.
    model, firmware : str
    status : int
        The sensor's status word.
    internal_rate_hz : float
        At which the sensor samples; 0 if not reported.
    """

    counts_per_force: float
    counts_per_torque: float
    force_unit: str
    torque_unit: str
    rate_hz: float
    serial: str = ""
    calibration: int = -1
    configuration: int = -1
    transform: str = ""
    bias: str = ""
    low_pass: str = ""
    model: str = ""
    firmware: str = ""
    status: int = 0
    internal_rate_hz: float = 0.0

    @property
    def sample_rate_hz(self) -> float:
        """The exact rate of the records.

        A record is every so many samples, and the page rounds the rate: 7000/21 Hz is shown as 333.

        >>> page = SensorPage(1.0, 1.0, "N", "Nm", 333.0, internal_rate_hz=7000.0)
        >>> page.sample_rate_hz == 7000.0 / 21
        True
        """
        exact_hz = self.internal_rate_hz / max(round(self.internal_rate_hz / self.rate_hz), 1)
        return exact_hz if abs(exact_hz - self.rate_hz) <= 0.5 else self.rate_hz

    @property
    def newton_per_count(self) -> float:
        """Force of one count, in N."""
        return FORCE_UNITS_N[self.force_unit] / self.counts_per_force

    @property
    def newton_metre_per_count(self) -> float:
        """Torque of one count, in N·m."""
        return TORQUE_UNITS_NM[self.torque_unit] / self.counts_per_torque


def page_changes(before: SensorPage, after: SensorPage) -> str:
    """Return the differences between two pages as text, without the status; empty if none."""
    old, new = asdict(before), asdict(after)
    return ", ".join(
        f"{name} {old[name]!r} became {new[name]!r}"
        for name in old
        if name != "status" and old[name] != new[name]
    )


def parse_page(text: bytes, device: str) -> SensorPage:
    """Parse the page.

    Parameters
    ----------
    text : bytes
    device : str
        Name of the sensor in error messages.

    Raises
    ------
    DeviceError
        If it is no such page, says one thing twice, a number or unit is not possible, or RDT is
        disabled on the sensor.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise DeviceError(
            f"{device}: /netftapi2.xml is not the page of a Net F/T ({error}); "
            "check that the address is the sensor's"
        ) from error
    found: dict[str, str] = {}
    for item in root.iter():
        text_of = (item.text or "").strip()
        if item.tag in found:
            raise DeviceError(
                f"{device}: {item.tag} is in /netftapi2.xml twice, as {found[item.tag]!r} and "
                f"{text_of!r}; a Net F/T says each thing once, so restart the sensor and check "
                "that nothing stands between it and this computer"
            )
        found[item.tag] = text_of

    def positive(tag: str) -> float:
        try:
            value = float(found.get(tag, ""))
        except ValueError:
            value = math.nan
        if not 0.0 < value < math.inf:
            raise DeviceError(
                f"{device}: {tag} in /netftapi2.xml is {found.get(tag, 'missing')!r}; "
                "it must be a number above zero"
            )
        return value

    def integer(tag: str, base: int = 10) -> int:
        written = found.get(tag, "")
        if not written:
            return -1
        try:
            value = int(written, base)
        except ValueError:
            value = -1
        if not 0 <= value <= LARGEST_INTEGER:
            raise DeviceError(
                f"{device}: {tag} in /netftapi2.xml is {written!r}; it must be a whole number from "
                f"0 to {LARGEST_INTEGER}"
            )
        return value

    def unit(tag: str, known: dict[str, float]) -> str:
        name = unit_name(found.get(tag, ""))
        if name not in known:
            raise DeviceError(
                f"{device}: the unit {tag} in /netftapi2.xml is {found.get(tag, 'missing')!r}; "
                f"it must be one of {', '.join(known)}"
            )
        return name

    if found.get("comrdte", "Enabled") not in ("Enabled", "1"):
        raise DeviceError(
            f"{device}: RDT (comrdte) is {found['comrdte']!r}; "
            "enable it on the sensor's Communications page"
        )
    return SensorPage(
        counts_per_force=positive("cfgcpf"),
        counts_per_torque=positive("cfgcpt"),
        force_unit=unit("scfgfu", FORCE_UNITS_N),
        torque_unit=unit("scfgtu", TORQUE_UNITS_NM),
        rate_hz=positive("comrdtrate"),
        serial=found.get("cfgcalsn", ""),
        calibration=integer("cfgcalsel"),
        configuration=integer("setcfgsel"),
        transform=found.get("cfgtfx", ""),
        bias=found.get("setbias", ""),
        low_pass=found.get("setuserfilter", ""),
        model=found.get("prodname", "Net F/T"),
        firmware=found.get("mfgdigver", ""),
        status=max(integer("runstat", 16), 0),
        internal_rate_hz=positive("runrate") if "runrate" in found else 0.0,
    )


def fetch_page(address: str, port: int, timeout_s: float, device: str, now: Now) -> SensorPage:
    """Fetch the page from the sensor's web server and parse it.

    Raises
    ------
    DeviceError
        If there is no valid answer in time.
    """
    give_up_s = now() + timeout_s
    connection = http.client.HTTPConnection(address, port, timeout=timeout_s)
    try:
        connection.request("GET", "/netftapi2.xml")
        with connection.getresponse() as response:
            if response.status != 200:
                raise DeviceError(
                    f"{device}: http://{address}:{port}/netftapi2.xml answers {response.status} "
                    f"{response.reason}; a Net F/T answers 200 OK"
                )
            text = b""
            # A server that sends byte by byte would never reach the timeout of a single read.
            while piece := response.read1(4096):
                text += piece
                if len(text) > LARGEST_PAGE_BYTES or now() > give_up_s:
                    raise DeviceError(
                        f"{device}: http://{address}:{port}/netftapi2.xml does not end within "
                        f"{timeout_s:g} s and {LARGEST_PAGE_BYTES} bytes; check the address"
                    )
    except (OSError, http.client.HTTPException) as error:
        raise DeviceError(
            f"{device}: http://{address}:{port}/netftapi2.xml gives no answer within "
            f"{timeout_s:g} s ({error or type(error).__name__}); "
            "check the sensor's power, cable and address"
        ) from error
    finally:
        connection.close()
    return parse_page(text, device)


def refuse_unexpected(settings: AtiRdtSettings, page: SensorPage, device: str) -> None:
    """Compare what the sensor reports with what the settings expect.

    Raises
    ------
    DeviceError
        If the sensor reports an error, or if a value differs; the message names the first.
    """
    if status_cause(page.status):
        words = ", ".join(status_words(page.status))
        raise DeviceError(
            f"{device}: its status is {page.status:#010x} ({words}); it must be without "
            "error, so remove the cause and power the sensor off and on"
        )
    for name, found, wanted, any_will_do in (
        ("serial", page.serial, settings.expected_serial, ""),
        ("calibration", page.calibration, settings.expected_calibration, -1),
        ("force_unit", page.force_unit, unit_name(settings.expected_force_unit), ""),
        ("torque_unit", page.torque_unit, unit_name(settings.expected_torque_unit), ""),
        ("rate_hz", page.rate_hz, settings.expected_rate_hz, 0.0),
    ):
        if wanted not in (any_will_do, found):
            raise DeviceError(
                f"{device}: its {name} is {found!r} where expected_{name} is {wanted!r}; "
                "correct the sensor or the settings"
            )
