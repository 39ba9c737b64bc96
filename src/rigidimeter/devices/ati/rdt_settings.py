"""What can be set of an ATI Net F/T, and whether the sensor is the one that was expected."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from rigidimeter.devices.ati.rdt_packets import status_cause, status_words
from rigidimeter.devices.ati.rdt_page import SensorPage, unit_name
from rigidimeter.devices.base import DeviceError
from rigidimeter.settings.section import Section, quantity

__all__ = ["AtiRdtSettings", "refuse_unexpected"]


class AtiRdtSettings(Section):
    """Where the sensor is, how it is mounted, what is expected of it.

    What is expected is compared with what the sensor says; an empty text, 0, or -1 for the
    calibration index, expects nothing.
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
    bias_limit_nm: float = quantity(0.2, "N·m", 0.0, 100.0)

    @property
    def emulated(self) -> bool:
        """Whether the address is of this computer: no sensor is inside it."""
        return self.address == "localhost" or self.address.startswith("127.")

    @model_validator(mode="after")
    def _some_weight(self) -> Self:
        if not any(self.weights):
            raise ValueError("weights are all zero; at least one axis must count")
        return self


def refuse_unexpected(settings: AtiRdtSettings, page: SensorPage, device: str) -> None:
    """Compare what the sensor says with what the settings expect.

    Raises
    ------
    DeviceError
        If the sensor reports an error, or naming the first value that differs.
    """
    if status_cause(page.status):
        words = ", ".join(status_words(page.status))
        raise DeviceError(
            f"{device}: its status is {page.status:#010x} ({words}); it must be without "
            "error, so put that right and power the sensor off and on"
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
                "set the sensor, or the settings, right"
            )
