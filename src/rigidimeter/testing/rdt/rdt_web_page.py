"""The web server of the emulated sensor: /netftapi2.xml, with its misbehaviours."""

from __future__ import annotations

import socketserver
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from http.server import BaseHTTPRequestHandler

from rigidimeter.testing.rdt.rdt_records import (
    COUNTS_PER_UNIT,
    SUPPLY_LOW,
    Faults,
    fault_value,
)

_NEWTONS = {"N": 1.0, "kN": 1e3, "lbf": 4.4482216152605, "kgf": 9.80665}
_NEWTON_METRES = {
    "Nm": 1.0,
    "N-m": 1.0,
    "Nmm": 1e-3,
    "N-mm": 1e-3,
    "kNm": 1e3,
    "lbf-in": 0.1129848290276167,
    "lbf-ft": 1.3558179483314004,
    "kgf-cm": 0.0980665,
}


@dataclass(frozen=True)
class PageFacts:
    """Contents of the page; counts per N·m whatever its units."""

    force_unit: str
    torque_unit: str
    rate_hz: float
    counts_per_nm: float = COUNTS_PER_UNIT
    serial: str = "FT00001"
    calibration: int = 0
    bias: int = 0
    rdt: str = "Enabled"
    status: int = 0


def page_text(page: PageFacts) -> bytes:
    """Write the page as the sensor does, with counts per unit; of an unknown unit, per N·m."""
    force_n = _NEWTONS[page.force_unit]
    torque_nm = _NEWTON_METRES.get(page.torque_unit, 1.0)
    elements = {
        "prodname": "Emulated Net F/T",
        "runstat": f"0x{page.status:08x}",
        "runrate": "7000",
        "setbias": f"0;0;0;0;0;{page.bias}",
        "setcfgsel": "0",
        "setuserfilter": "0",
        "cfgnam": "elbow",
        "cfgcalsel": page.calibration,
        "cfgcalsn": page.serial,
        "cfgcpf": f"{COUNTS_PER_UNIT * force_n:.12g}",
        "cfgcpt": f"{page.counts_per_nm * torque_nm:.12g}",
        "scfgfu": page.force_unit,
        "scfgtu": page.torque_unit,
        "cfgtfx": "0;0;0;0;0;0",
        "comrdte": page.rdt,
        "comrdtrate": f"{page.rate_hz:g}",
        "comrdtbsiz": "1",
        "mfgdigver": "2.2.59",
    }
    body = "".join(f"<{tag}>{value}</{tag}>\n" for tag, value in elements.items())
    return f'<?xml version="1.0"?>\n<netft>\n{body}</netft>\n'.encode()


def page_with_faults(page: PageFacts, faults: Faults) -> PageFacts:
    """Return the page with these misbehaviours applied."""
    page = replace(page, status=int(fault_value(faults, "page_status", SUPPLY_LOW) or 0))
    if "page_rate" in faults:
        page = replace(page, rate_hz=fault_value(faults, "page_rate", 7000.0) or 7000.0)
    if "changed_units" in faults:
        page = replace(page, torque_unit="lbf-in")
    if "unknown_units" in faults:
        page = replace(page, torque_unit="cubit-stone")
    if "changed_calibration" in faults:
        page = replace(
            page, serial="FT99999", calibration=7, counts_per_nm=2.0 * page.counts_per_nm
        )
    if "changed_bias" in faults:
        page = replace(page, bias=123456)
    if "rdt_disabled" in faults:
        page = replace(page, rdt="Disabled")
    return page


class SensorPageServer(socketserver.ThreadingTCPServer):
    """Answers every request with the page, or as the misbehaviours say.

    Parameters
    ----------
    address : tuple
    page : callable
        Returns the present page.
    fault : callable
        Returns the value of a misbehaviour, None if it is not active.
    ending : threading.Event
        Ends the waiting of handlers.
    """

    allow_reuse_address = True
    daemon_threads = False  # closing waits for them

    def __init__(
        self,
        address: tuple[str, int],
        page: Callable[[], bytes],
        fault: Callable[[str, float], float | None],
        ending: threading.Event,
    ) -> None:
        self.page, self.fault, self.ending = page, fault, ending
        super().__init__(address, _Handler)


class _Handler(BaseHTTPRequestHandler):
    server: SensorPageServer
    timeout = 2.0

    def do_GET(self) -> None:
        """Answer a request."""
        fault, wait = self.server.fault, self.server.ending.wait
        if fault("http_silent", 1) is not None:
            wait(30.0)
            return
        wait(fault("http_slow", 0.5) or 0.0)
        if fault("http_error", 1) is not None:
            self.send_error(500)
            return
        if self.path.partition("?")[0] != "/netftapi2.xml":
            self.send_error(404)
            return
        body = self.server.page()
        if fault("http_garbage", 1) is not None:
            body = b"<html><body>It works!<br></body>"
        self.send_response(200)
        self.send_header("Content-Type", "text/xml")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        drip_s = fault("http_drip", 0.1)
        try:
            if drip_s is None:
                self.wfile.write(body)
                return
            for byte in body:
                self.wfile.write(bytes([byte]))
                if wait(drip_s):
                    return
        except OSError:
            self.close_connection = True  # the client closed the connection

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing."""
