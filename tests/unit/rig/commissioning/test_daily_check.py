"""The daily check on a fake rig with an empty cuff: what it passes, and what it must find."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from tests.unit.rig.commissioning.conftest import QUICK

from rigidimeter.rig.commissioning import (
    FIRST,
    NEW,
    CommissioningRecord,
    Compared,
    DailyRecord,
    Operator,
    ReferenceInertia,
    Setup,
    daily_check,
)

CUFF = (0.002, 0.0, 0.0)
MADE = "2026-01-02T08:00:00+00:00"


@pytest.fixture(scope="module")
def made() -> list[CommissioningRecord]:
    """What `record` made."""
    return []


@pytest.fixture
def record(commissioned: Any, made: list[CommissioningRecord]) -> Any:
    """The commissioning record of the fake rig; made once, with a load."""
    if not made:
        made.append(commissioned())
    return made[0]


@pytest.fixture
def checked(record: Any, settings: Any, fake_rig: Any) -> Any:
    """Check the fake rig, the cuff empty, with faults."""

    def run(
        *,
        joint: tuple[float, float, float] = CUFF,
        noise_sd_nm: float = 0.005,
        consent: bool = True,
        questions: list[str] | None = None,
        compared: Compared | None = None,
        commissioned: Any = record,
        **faults: Any,
    ) -> DailyRecord:
        rig, file, timebase, world = fake_rig(joint, noise_sd_nm, True, faults)

        def ask(question: str) -> bool:
            if questions is not None:
                questions.append(question)
            return consent

        chosen = settings.model_copy(update={"commissioning": QUICK})
        found = daily_check(
            Setup(rig, chosen, timebase, Operator(ask=ask)),
            file,
            lambda _: commissioned,
            compared=compared or Compared(reference=reference(record)),
            made_utc=MADE,
            software="0",
        )
        run.took_s, run.angle_rad = timebase.now(), world.arm.motion()[0]  # type: ignore[attr-defined]
        return found

    return run


def reference(record: Any, inertia_kg_m2: float = CUFF[0]) -> ReferenceInertia:
    return ReferenceInertia(inertia_kg_m2, 2e-5, "2026-01-01T09:00:00+00:00", record.digest, FIRST)


def failed(record: DailyRecord) -> list[str]:
    return [check.name for check in record.checks if check.outcome == "failed"]


def test_a_sound_rig_passes_within_20_s_and_asks_one_question(checked: Any, record: Any) -> None:
    questions: list[str] = []
    found = checked(questions=questions)
    assert failed(found) == []
    assert found.passed
    assert len(questions) == 1
    assert "Nobody's arm may be in the rig" in questions[0]
    assert checked.took_s < 20.0
    assert abs(checked.angle_rad) < math.radians(0.1)
    assert found.numbers["inertia_kg_m2"] == pytest.approx(CUFF[0], rel=0.05)
    assert found.numbers["torque_after_motion_s"] == pytest.approx(0.0, abs=0.005)
    assert found.reference == reference(record)
    assert found.commissioning_digest == record.digest


@pytest.mark.parametrize(
    ("faults", "name"),
    [
        ({"torque_scale": -1.0}, "sign of the torque"),
        ({"torque_scale": 0.5}, "inertia"),
        ({"torque_scale": 1.3}, "inertia"),
        ({"dead": True}, "different torque values"),
        ({"other_axis": True}, "sign of the torque"),
        ({"angle_scale": -1.0}, "angle per command"),
        ({"angle_scale": 1.05}, "angle per command"),
        ({"angle_scale": -1.0, "command_scale": -1.0}, "sign of the torque"),
        ({"drift_rad_s": math.radians(2.0)}, "motion when enabled"),
        ({"torque_delay_s": 0.05}, "torque behind the angle"),
        ({"bias_nm": 1.5}, "torque at rest"),
        ({"noise_sd_nm": 0.3}, "torque noise (SD)"),
        ({"joint": (0.0045, 0.1368, 1.751)}, "inertia"),
        ({"no_answer": True}, "devices read back"),
    ],
)
def test_a_fault_fails_its_check(checked: Any, faults: dict[str, Any], name: str) -> None:
    found = checked(**faults)
    assert failed(found)[0] == name
    assert not found.passed
    assert name in found.objection
    check = next(check for check in found.checks if check.name == name)
    assert check.remedy


def test_what_is_too_light_to_tell_the_gain_by_is_refused(checked: Any) -> None:
    found = checked(joint=(0.0001, 0.0, 0.0), noise_sd_nm=0.02, compared=Compared())
    assert not found.passed
    assert "fasten a weight" in found.objection
    assert found.reference is None


def test_nothing_moves_without_consent(checked: Any) -> None:
    found = checked(consent=False)
    assert checked.angle_rad == 0.0
    assert failed(found) == []
    assert not found.passed
    assert found.objection.endswith("the operator did not agree to it")


def test_the_first_check_keeps_the_reference(checked: Any, record: Any) -> None:
    found = checked(compared=Compared())
    assert found.passed
    assert found.reference is not None
    assert found.reference.reason == FIRST
    assert found.reference.inertia_kg_m2 == found.numbers["inertia_kg_m2"]
    assert found.reference.before_kg_m2 is None


def test_a_rig_commissioned_again_gets_a_new_reference_that_names_the_old(
    checked: Any, record: Any
) -> None:
    old = replace(reference(record, 0.003), commissioning_digest="of another")
    found = checked(compared=Compared(reference=old))
    assert found.passed
    assert found.reference is not None
    assert (found.reference.reason, found.reference.before_kg_m2) == (FIRST, 0.003)


def test_another_cuff_is_told(checked: Any, record: Any) -> None:
    old = reference(record, 0.003)
    assert failed(checked(compared=Compared(reference=old))) == ["inertia"]
    found = checked(compared=Compared(reference=old, new=True))
    assert found.passed
    assert found.reference is not None
    assert (found.reference.reason, found.reference.before_kg_m2) == (NEW, 0.003)
    assert found.reference.inertia_kg_m2 == pytest.approx(CUFF[0], rel=0.05)


def test_a_failed_check_keeps_the_old_reference(checked: Any, record: Any) -> None:
    old = reference(record, 0.003)
    found = checked(compared=Compared(reference=old, new=True), torque_scale=-1.0)
    assert found.reference == old


@pytest.mark.parametrize(("true", "wrong"), [(0.002, []), (0.004, ["inertia"])])
def test_a_known_inertia_is_compared_in_place_of_the_reference(
    checked: Any, record: Any, true: float, wrong: list[str]
) -> None:
    old = reference(record, 0.003)
    found = checked(compared=Compared(known_inertia_kg_m2=true, reference=old))
    assert failed(found) == wrong
    assert found.reference == old
    assert found.known_inertia_kg_m2 == true


def test_a_commissioning_record_without_the_delay_is_not_enough(checked: Any, record: Any) -> None:
    found = checked(commissioned=replace(record, numbers={}))
    assert failed(found) == []
    assert "'torque behind the angle' is missing: the commissioning record" in found.objection
