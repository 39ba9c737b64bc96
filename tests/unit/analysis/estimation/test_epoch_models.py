"""The clock on which models take the torque, and which epochs are refused."""

from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.estimation.epoch_models import clock_of_models, model_epoch
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel

JBK = ("inertia", "damping", "stiffness")


def prepared_of(**changes):
    made = scenario("one", **changes)
    (epoch,), _ = made.simulated(1, 1)
    (prepared,) = prepare([epoch], made.analysed_with())
    return prepared


def test_friction_is_fitted_to_the_torque_as_recorded():
    """With J, B and K alone a friction of 0.1 N·m makes the torque look 5 ms late."""
    recorded = prepared_of(joint={"coulomb_nm": 0.1})
    models = [(*JBK, "coulomb")]
    chosen, remark = clock_of_models(recorded.moved(0.005), recorded, models)
    assert chosen is recorded
    assert "torque as recorded: J, B and K alone would have it 5 ms late" in remark
    (row,) = model_epoch(chosen, models).compared.rows
    assert row.fit is not None
    assert row.fit["coulomb"].value == pytest.approx(0.1, rel=0.03)
    (beyond,) = row.beyond
    assert beyond.value == pytest.approx(0.1, rel=0.06)


def test_a_torque_that_is_late_is_moved():
    recorded = prepared_of(torque={"late_s": 0.004})
    aligned = recorded.moved(0.004)
    assert clock_of_models(aligned, recorded, [(*JBK, "coulomb")]) == (aligned, "")
    assert clock_of_models(recorded, recorded, [JBK]) == (recorded, "")


def test_a_motion_that_cannot_tell_j_from_k_gets_no_recommendation():
    prepared = prepared_of()
    epoch = prepared.epoch
    time_s = epoch.channels["torque_nm"].time_s
    values = {
        "torque_nm": np.sin(12.0 * time_s) + np.sin(13.0 * time_s),
        "angle_rad": 0.1 * np.sin(12.0 * time_s - 0.3) + 0.1 * np.sin(13.0 * time_s - 0.3),
    }
    noise = np.random.default_rng(1).standard_normal((2, time_s.size))
    channels = {
        name: Channel(name, time_s, one + 1e-3 * more)
        for (name, one), more in zip(values.items(), noise, strict=True)
    }
    (narrow,) = prepare([replace(epoch, channels=channels)], prepared.settings)
    compared = model_epoch(narrow, [JBK], compare=True).compared
    assert compared.recommended is None
    assert "none of these models" in compared.reason


def test_a_subject_who_pushes_asks_for_caution_with_models_though_iv_would_not_be_biased():
    """Least squares fits the models: what the subject's torque does to them is not harmless."""
    prepared = prepared_of(subject={"voluntary_nm": 0.2})
    compared = model_epoch(prepared, [JBK], compare=True)
    findings = {one.name: one for one in compared.findings}
    assert findings["voluntary_torque"].level == "caution"
    assert "loop_bias" in findings
    assert not any("not biased" in one.details for one in findings.values())
