import pytest
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.recordings import measured_alone

from rigidimeter.study import estimate


@pytest.mark.parametrize(("name", "late_ms"), [("torque stamped 4 ms late", 4.0), ("relaxed", 0.0)])
def test_a_delay_that_is_not_corrected_is_said_where_it_matters(name, late_ms):
    epochs, _ = SCENARIOS[name].simulated(0, 1)
    analysis = estimate([measured_alone(epoch) for epoch in epochs], "bandlimited")
    found = [one for one in analysis.fits[0].findings if one.name == "torque_delay"]
    if not late_ms:
        assert found == []
        return
    (finding,) = found
    assert finding.level == "doubt"
    assert finding.value == pytest.approx(late_ms, rel=0.1)
    # B τ off J is less than half its interval below that delay.
    J = analysis.fits[0]
    assert finding.threshold <= 1e3 * 0.5 * (J.high[0] - J.low[0]) / J.value[1] * 1.001
