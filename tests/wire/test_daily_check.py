"""The daily check over true wires, in real time, against the emulated rig with an empty cuff."""

from __future__ import annotations

import math
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
from tests.wire.rig_process import RigProcess
from tests.wire.trial_setup import settings, setup

from rigidimeter.rig.commissioning import (
    Compared,
    DailyRecord,
    Operator,
    ReferenceInertia,
    daily_check,
)
from rigidimeter.rig.devices import load_rig

pytest.importorskip("can")
pytest.importorskip("canopen")
pytest.importorskip("serial")

CUFF_KG_M2 = 0.002
COMMISSIONED: Any = SimpleNamespace(
    digest="of the commissioning", numbers={"torque_after_motion_s": 0.001}
)
RATES_HZ = {"cia402": 250.0, "ascii": 60.0}


@pytest.fixture(scope="module", params=["cia402", pytest.param("ascii", marks=pytest.mark.slow)])
def bench(request: Any, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    drive = request.param
    with RigProcess(tmp_path_factory.mktemp(drive) / "RIG.toml", drive) as bench:
        bench.drive = drive
        bench.command(f"joint {CUFF_KG_M2} 0 0")
        yield bench


def checked(bench: Any) -> DailyRecord:
    rate_hz = RATES_HZ[bench.drive]
    chosen = settings(rate_hz, commissioning={"daily_rest_s": 1.0, "daily_motion_s": 3.0})
    rigfile, operator = load_rig(bench.rig), Operator(ask=lambda _: True, present=False)
    with rigfile.claim() as lock:
        return daily_check(
            setup(rigfile, chosen, operator, lock=lock),
            rigfile,
            lambda _: COMMISSIONED,
            compared=Compared(
                reference=ReferenceInertia(
                    CUFF_KG_M2, 2e-5, "2026-01-01", COMMISSIONED.digest, "first"
                )
            ),
            made_utc="2026-01-02T08:00:00+00:00",
            software="0",
        )


def failed(record: DailyRecord) -> list[str]:
    return [check.name for check in record.checks if check.outcome == "failed"]


def test_a_sound_rig_passes_and_stands_without_power_where_it_stood(bench: Any) -> None:
    before_rad = bench.state()["angle_rad"]
    found = checked(bench)
    assert failed(found) == []
    assert found.passed
    assert found.numbers["inertia_kg_m2"] == pytest.approx(CUFF_KG_M2, rel=0.15)
    state = bench.state()
    assert state["power"] is False
    assert abs(state["angle_rad"] - before_rad) < math.radians(1.0)


ENCODER_SIGN = {"cia402": "encoder sign", "ascii": "encoder_sign_flip"}
DRIFT = {"cia402": "drifts", "ascii": "runs_away"}


SIGN, SLOW = "sign of the torque", pytest.mark.slow


@pytest.mark.parametrize(
    ("role", "fault", "value", "names"),
    [
        pytest.param("torque", "gain", -1.0, {SIGN}, marks=SLOW),
        # The guard may be the first to say that so little torque is none.
        pytest.param("torque", "gain", 0.5, {"inertia", SIGN}, marks=SLOW),
        pytest.param("torque", "gain", 0.0, {"different torque values"}, marks=SLOW),
        pytest.param("torque", "other_axis", None, {SIGN}, marks=SLOW),
        pytest.param("torque", "delay", 0.05, {"torque behind the angle"}, marks=SLOW),
        pytest.param("drive", ENCODER_SIGN, None, {"angle per command"}, marks=SLOW),
        ("drive", DRIFT, math.radians(2.0), {"motion when enabled"}),
    ],
)
def test_a_fault_fails_its_check(
    bench: Any, role: str, fault: Any, value: float | None, names: set[str]
) -> None:
    bench.misbehave(role, fault if isinstance(fault, str) else fault[bench.drive], value)
    try:
        found = checked(bench)
    finally:
        bench.behave()
    assert failed(found)[0] in names, [c for c in found.checks if c.outcome == "failed"]
    assert not found.passed
    assert bench.state()["power"] is False
