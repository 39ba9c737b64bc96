from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.recordings import measured_alone
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.estimation import aligned, estimate_delays
from rigidimeter.analysis.estimation.closedloop.recorded_perturbation import period_s
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.core.records import Channel
from rigidimeter.virtual import PAPER_RATES


def late(epoch, delay_s):
    torque = epoch.channels["torque_nm"]
    moved = Channel("torque_nm", torque.time_s + delay_s, torque.values)
    return replace(epoch, channels={**epoch.channels, "torque_nm": moved})


@pytest.mark.parametrize("rig", [{}, PAPER_RATES], ids=["1 kHz", "paper"])
@pytest.mark.parametrize("delay_s", [0.007, -0.003, 0.025])
def test_an_injected_delay_is_found_and_taken_out(simulated, rig, delay_s):
    settings, epochs = simulated(2, voluntary_sd_nm=0.1, **rig)
    moved = [late(epoch, delay_s) for epoch in epochs]
    (found,) = estimate_delays({epochs[0].source: prepare(moved, settings)})
    assert found.delay_s == pytest.approx(delay_s, abs=5e-4)
    assert found.delay_s_se < 5e-4
    assert found.corrected
    back = aligned(moved[0], [found]).channels["torque_nm"]
    np.testing.assert_allclose(back.time_s, epochs[0].channels["torque_nm"].time_s, atol=5e-4)


def test_a_latency_that_the_stamps_do_not_know_is_a_delay(simulated):
    settings, epochs = simulated(3, torque={"latency_s": 0.005, "stamp_latency_s": 0.001})
    (found,) = estimate_delays({epochs[0].source: prepare(epochs, settings)})
    assert found.delay_s == pytest.approx(0.004, abs=2e-4)


def test_no_delay_changes_nothing(simulated):
    settings, epochs = simulated(2)
    (found,) = estimate_delays({epochs[0].source: prepare(epochs, settings)})
    assert abs(found.delay_s) < 1e-4
    assert not found.corrected
    assert aligned(epochs[0], [found]) is epochs[0]


def rubbing(epoch, friction_nm):
    """Add friction of the joint to the recorded torque."""
    torque, velocity = (epoch.channels[name] for name in ("torque_nm", "velocity_rad_s"))
    there = np.interp(torque.time_s, velocity.time_s, velocity.values)
    more = Channel("torque_nm", torque.time_s, torque.values + friction_nm * np.sign(there))
    return replace(epoch, channels={**epoch.channels, "torque_nm": more})


def without_perturbation(epoch):
    kept = {k: c for k, c in epoch.channels.items() if k != "perturbation_nm"}
    return replace(epoch, channels=kept)


@pytest.mark.parametrize("recorded", [True, False])
@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.1])
def test_friction_is_not_taken_for_a_delay(simulated, voluntary_sd_nm, recorded):
    settings, epochs = simulated(2, voluntary_sd_nm=voluntary_sd_nm)
    rubbed = [rubbing(epoch, 0.1) for epoch in epochs]
    if not recorded:
        rubbed = [without_perturbation(epoch) for epoch in rubbed]
    (found,) = estimate_delays({"file": prepare(rubbed, settings)})
    assert not found.corrected
    if not voluntary_sd_nm:
        assert found.delay_s > 0.002
        assert "not corrected: friction explains it better" in found.remark


@pytest.mark.parametrize("voluntary_sd_nm", [0.0, 0.1])
def test_without_the_perturbation_the_motion_tells_it(simulated, voluntary_sd_nm):
    settings, epochs = simulated(2, voluntary_sd_nm=voluntary_sd_nm)
    moved = [late(without_perturbation(epoch), 0.004) for epoch in epochs]
    (found,) = estimate_delays({"file": prepare(moved, settings)})
    assert found.delay_s == pytest.approx(0.004, abs=2e-4)
    assert found.corrected


@pytest.mark.parametrize(("cuff_nm_rad", "damping_nm_s_rad"), [(100.0, 0.5), (40.0, 0.4)])
def test_without_the_perturbation_a_damped_cuff_is_not_taken_for_a_delay(
    cuff_nm_rad, damping_nm_s_rad
):
    cuff = {"cuff_nm_rad": cuff_nm_rad, "cuff_nm_s_rad": damping_nm_s_rad}
    soft = scenario("damped cuff", joint=cuff)
    alone = [measured_alone(epoch) for epoch in soft.simulated(0, 2).epochs]
    (found,) = estimate_delays({alone[0].source: prepare(alone, soft.analysed_with())})
    assert "a soft cuff explains it" in found.remark


def test_a_subject_who_pushes_hard_does_not_hide_a_late_torque():
    """The search begins where each line counts by its noise."""
    pushes = scenario("pushes", subject={"voluntary_nm": 0.5}, torque={"late_s": 0.004})
    alone = [measured_alone(epoch) for epoch in pushes.simulated(0, 4).epochs]
    (found,) = estimate_delays({alone[0].source: prepare(alone, pushes.analysed_with())})
    assert found.delay_s == pytest.approx(0.004, abs=2e-4)


def test_a_source_without_perturbation_epochs_says_so():
    (found,) = estimate_delays({"file": []})
    assert np.isnan(found.delay_s)
    assert found.remark


def test_the_period_is_that_of_the_sequence(simulated):
    _, (epoch,) = simulated()
    assert period_s(epoch.channels["perturbation_nm"]) == pytest.approx(127 / 20, abs=1e-3)
    noise = np.random.default_rng(0).standard_normal(5000)
    assert period_s(Channel("perturbation_nm", np.arange(5000) / 1e3, noise)) is None


def test_the_error_holds_between_coarse_samples(simulated):
    """There a move of the torque takes away about a third of itself: three times too small."""
    settings, epochs = simulated(5, voluntary_sd_nm=0.1, **PAPER_RATES)
    found = estimate_delays({str(i): prepare([one], settings) for i, one in enumerate(epochs)})
    scores = [one.delay_s / one.delay_s_se for one in found]
    assert np.mean(np.square(scores)) < 2.0
    assert not any(one.corrected for one in found)
