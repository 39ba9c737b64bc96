"""The methods of the closed loop without a stretch in which the torque sensor hung."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from rigidimeter.estimation.closedloop.linear_problems import instrumental
from rigidimeter.estimation.closedloop.observation import observe, observe_periods
from rigidimeter.estimation.closedloop.refine import fit_pooled, fit_single
from rigidimeter.estimation.diagnostics import checked
from rigidimeter.estimation.methods import method_named
from rigidimeter.estimation.prepared import prepare
from rigidimeter.records import Channel


def hung(epoch, after_s, for_s):
    torque = epoch.channels["torque_nm"]
    values = torque.values.copy()
    since_s = torque.time_s - torque.time_s[0]
    rows = (since_s >= after_s) & (since_s <= after_s + for_s)
    values[rows] = values[rows][0]
    changed = Channel("torque_nm", torque.time_s, values)
    return replace(epoch, channels={**epoch.channels, "torque_nm": changed})


@pytest.mark.parametrize("method", ["iv", "spectral"])
def test_the_rest_of_the_epoch_gives_the_joint(simulated, truth, method):
    settings, (epoch,) = simulated(1)
    (prepared,) = prepare([hung(epoch, 1.5, 0.5)], settings)
    (fit,), _ = method_named(method).fit([prepared], None, lambda _: None, False)
    fit = checked(prepared, fit)
    assert fit.outcome.included, fit.outcome.reason
    assert fit.value == pytest.approx(truth, rel=0.01)
    assert [found.level for found in fit.findings if found.name == "frozen"] == ["note"]
    whole = len(epoch.channels["torque_nm"])
    assert 0.5 * whole < fit.n_samples < 0.98 * whole


def test_a_window_with_a_hole_widens_the_intervals(simulated):
    settings, (epoch,) = simulated(1)
    (prepared,) = prepare([epoch], settings)
    plain = observe(prepared)
    spread = replace(plain.lines.grid, spread=4.0)
    wider = plain._replace(lines=replace(plain.lines, grid=spread))
    start = np.array([0.004, 0.1, 1.5])
    one, two = (fit_single(each, instrumental, start) for each in (plain, wider))
    assert two.covariance == pytest.approx(4 * one.covariance)
    assert two.bound == pytest.approx(4 * one.bound)
    assert two.degrees == pytest.approx(one.degrees / 4)
    one, two = (fit_pooled([each], instrumental, start)[0] for each in (plain, wider))
    assert two.covariance == pytest.approx(4 * one.covariance)


def test_whole_periods_are_taken_from_the_longest_part(simulated):
    settings, (epoch,) = simulated(1)
    (prepared,) = prepare([hung(epoch, 1.5, 0.5)], settings)
    grid = observe_periods(prepared).lines.grid
    assert grid.time_s[0] > epoch.channels["torque_nm"].time_s[0] + 2.0
    assert grid.spread == 1.0
