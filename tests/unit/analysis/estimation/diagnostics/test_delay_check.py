from dataclasses import replace

import numpy as np
import pytest
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.recordings import measured_alone
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.estimation.prepared import torque_earlier
from rigidimeter.analysis.reading import identify
from rigidimeter.analysis.study import estimate


@pytest.mark.parametrize(
    ("name", "late_ms", "recording", "epochs"),
    [
        ("friction in the joint 0.02 N·m", 1.43, 0, 1),
        ("torque stamped 4 ms late", 0.0, 0, 1),
        ("relaxed", 0.0, 0, 1),
        # 0.04 ms, at 3.1 standard errors: the acceleration is late by ζ ω₀ T²/6 = 0.037 ms.
        ("ankle, relaxed", 0.0, 1, 4),
    ],
)
def test_a_delay_that_is_not_corrected_is_said_where_it_matters(name, late_ms, recording, epochs):
    epochs, _ = SCENARIOS[name].simulated(recording, epochs)
    alone = [measured_alone(epoch) for epoch in epochs]
    analysis = estimate(alone, "bandlimited", settings=SCENARIOS[name].analysed_with())
    found = [one for one in analysis.fits[0].findings if one.name == "torque_delay"]
    if not late_ms:
        assert found == []
        return
    (finding,) = found
    assert "torque_delay" in {one.name for one in analysis.pooled[0].findings}
    assert finding.level == "caution"
    assert finding.value == pytest.approx(late_ms, rel=0.1)
    assert max(np.abs(finding.effect.half_intervals)) == pytest.approx(
        finding.value / finding.limit, rel=1e-3
    )


@pytest.mark.parametrize("subject", [{}, {"tremor_nm": 1.0}])
def test_its_effect_is_what_a_move_of_the_torque_changes(subject):
    """Under tremor weights move B of a torque 2 ms late by +30 %, where K τ is 3 % of it."""
    uncorrected = {"estimation": {"correct_delay": False}}
    late = scenario("late", subject=subject, torque={"late_s": 0.002}, settings=uncorrected)
    (epoch,), _ = late.simulated(0, 1)
    first = estimate([measured_alone(epoch)], "bandlimited", settings=late.analysed_with())
    earlier = torque_earlier(measured_alone(epoch), first.delays[0].delay_s)
    then = estimate([earlier], "bandlimited", settings=late.analysed_with())
    (fit,), (moved,) = first.fits, then.fits
    (finding,) = [one for one in fit.findings if one.name == "torque_delay"]
    changed = 100 * (fit.value / moved.value - 1)
    np.testing.assert_allclose(finding.effect.percent, changed, rtol=0.1, atol=0.3)


def test_of_arrays_it_is_said_as_of_a_file():
    scenario = SCENARIOS["friction in the joint 0.02 N·m"]
    (epoch,), _ = scenario.simulated(0, 1)
    channels = measured_alone(epoch).channels
    arrays = {name: channel.values for name, channel in channels.items()}
    fit = identify(**arrays, rate_hz=1000.0, settings=scenario.analysed_with())
    assert "torque_delay" in {finding.name for finding in fit.findings}


@pytest.mark.parametrize(
    ("method", "late_ms", "corrected"),
    [("iv", 2.0, True), ("bandlimited", 2.0, True), ("bandlimited", 0.0, False)],
)
def test_a_motor_that_holds_its_torque_is_within_the_intervals(method, late_ms, corrected):
    """There the acceleration alone is late, by half a tick: corrected, J is 1.5 % high, B 0.6 %.

    With the perturbation recorded and no command, a drive of first order is not ruled out.
    """
    late = f", torque {late_ms:.0f} ms late" if late_ms else ""
    scenario = SCENARIOS[f"torque motor{late}"]
    epochs, truth = scenario.simulated(0, 2)
    if method == "bandlimited":
        epochs = [measured_alone(epoch) for epoch in epochs]
    analysis = estimate(epochs, method, settings=scenario.analysed_with())
    assert analysis.delays[0].corrected == corrected
    assert analysis.delays[0].delay_s == pytest.approx(1e-3 * late_ms + 0.0005, abs=1e-4)
    for fit in (*analysis.fits, analysis.pooled[-1]):
        assert np.all((fit.low <= truth[0]) & (truth[0] <= fit.high))
        np.testing.assert_allclose(fit.value, truth[0], rtol=0.02)
        said = {"iv": ["between_samples"], "bandlimited": []}
        assert [one.name for one in fit.findings] == said[method]


@pytest.mark.parametrize("name", ["drive PI 20 Hz with load", "drive PI 30 Hz, 500/s"])
def test_with_the_command_recorded_what_the_drive_does_is_no_delay(name):
    """The drive is followed, and what is left between torque and motion is no delay."""
    (epoch,), truth = SCENARIOS[name].simulated(0, 1)
    channels = {k: v for k, v in epoch.channels.items() if k != "perturbation_nm"}
    known = replace(epoch, channels=channels, excitation_hz=None)
    analysis = estimate([known], "bandlimited", settings=SCENARIOS[name].analysed_with())
    (fit,) = analysis.fits
    assert not {finding.name for finding in fit.findings if finding.level != "note"}
    assert abs(analysis.delays[0].delay_s) < 4.0 * analysis.delays[0].delay_s_se
    np.testing.assert_allclose(fit.value, truth[0], rtol=0.004)
