"""J, B and K of epochs in which ticks came late or never ran, or rows are missing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.replayed import assert_folder_replayed
from tests.unit.rig.acquisition.exact_rig import LateClock

from rigidimeter.analysis.estimation.diagnostics import checked
from rigidimeter.analysis.estimation.methods import method_named
from rigidimeter.analysis.estimation.prepared import prepare
from rigidimeter.analysis.reading import read
from rigidimeter.core.records import Channel, Ticks
from rigidimeter.core.session import SessionWriter
from rigidimeter.core.settings import parse_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import run_session
from rigidimeter.rig.devices import SimulatedRig

EPOCH_S = 12.0
SETTINGS = parse_settings(
    {
        "prbs": {"duration_s": EPOCH_S},
        "protocol": {"blocks": [{"task": "prbs", "condition": "OFF", "epochs": 1}]},
        "subject": {"OFF": {"voluntary_sd_nm": 0.0}},
    }
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Run an epoch of the virtual rig whose ticks are late by so many seconds."""

    def run(late):
        settings = SETTINGS
        protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
        rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(1))
        folder = tmp_path_factory.mktemp("late") / "session"
        writer = SessionWriter(folder, settings, [], {}, virtual=True)
        ended = run_session(protocol, settings, rig, LateClock(late), writer)
        assert_folder_replayed(folder)
        assert ended.outcome == "success", ended.reason
        (epoch,) = read(folder).epochs
        joint = rig.joint
        return epoch, [joint.inertia_kg_m2, joint.damping_nm_s_rad, joint.stiffness_nm_rad]

    return run


def estimated(epoch, method="iv"):
    (prepared,) = prepare([epoch], SETTINGS)
    (fit,), _ = method_named(method).fit([prepared], None, lambda _: None, False)
    return checked(prepared, fit)


def test_late_and_missed_ticks_are_counted(recorded):
    epoch, _ = recorded({500: 0.0005, 700: 0.0204, 900: 0.0006})
    assert epoch.ticks == Ticks(ran=11980, late=2, missed=20)
    assert epoch.ticks.missed_percent == pytest.approx(100 * 20 / 12000)


@pytest.mark.parametrize(
    ("missed", "method", "level"),
    [
        (12, "iv", None),
        (13, "iv", "note"),
        (13, "bandlimited", "note"),
        (13, "published", "caution"),
    ],
)
def test_above_a_thousandth_missed_ticks_are_a_finding_that_says_what_they_do(
    recorded, missed, method, level
):
    epoch, _ = recorded({})
    fit = estimated(replace(epoch, ticks=Ticks(12000 - missed, 4, missed)), method)
    found = {each.name: each for each in fit.findings}.get("missed_ticks")
    if level is None:
        assert found is None
        return
    assert found.level == level
    facts = found.facts
    assert (facts["missed"], facts["ticks"], facts["late"]) == (13, 12000, 4)
    assert found.value == pytest.approx(100 * 13 / 12000)
    assert (facts.get("variant") == "followed") == (level == "note")
    assert ("--cpu" in found.remedy) == (level != "note")


def test_without_the_loops_own_counts_nothing_is_said_of_ticks(recorded):
    epoch, _ = recorded({})
    fit = estimated(replace(epoch, ticks=None))
    assert "missed_ticks" not in {each.name for each in fit.findings}


def some_late(ticks, seed=0):
    """Return so many late ticks, in the mean by 1 ms."""
    rng = np.random.default_rng(seed)
    which = rng.choice(np.arange(50, int(950 * EPOCH_S)), ticks, replace=False)
    return {int(tick): min(rng.exponential(1e-3), 0.03) for tick in which}


@pytest.mark.parametrize("method", ["iv", "bandlimited"])
@pytest.mark.parametrize(
    "late", [{700: 0.0006}, {700: 0.0204}, some_late(60)], ids=["0.6 ms", "20 ms", "60 ticks"]
)
def test_late_and_missed_ticks_leave_the_joint_as_it_is(recorded, method, late):
    """A drive that is taken for unknown takes 0.8 % off J, ten standard errors."""
    epoch, truth = recorded(late)
    fit = estimated(epoch, method)
    assert fit.outcome.included
    assert [found.name for found in fit.findings if found.level != "note"] == []
    assert np.all((fit.low <= truth) & (truth <= fit.high))
    assert fit.value[0] == pytest.approx(truth[0], rel=2e-3)
    assert fit.high[0] - fit.low[0] < 0.01 * truth[0]


@pytest.mark.parametrize(("rows", "runs"), [(1, 1), (1, 300), (20, 1)])
def test_rows_that_are_missing_leave_the_joint_as_it_is(recorded, rows, runs):
    """What was sent in them is not known: the drive did not hold the command before."""
    epoch, truth = recorded({})
    rng = np.random.default_rng(3)
    firsts = np.sort(rng.choice(np.arange(100, int(950 * EPOCH_S), 25), runs, replace=False))
    gone = (firsts[:, None] + np.arange(rows)).ravel() / 1000.0
    channels = {}
    for name, one in epoch.channels.items():
        there = ~np.isin(np.round(one.time_s, 6), np.round(gone, 6))
        assert np.count_nonzero(~there) == rows * runs
        channels[name] = Channel(name, one.time_s[there], one.values[there])
    fit = estimated(replace(epoch, channels=channels, ticks=None))
    assert [found.name for found in fit.findings if found.level != "note"] == []
    assert np.all((fit.low <= truth) & (truth <= fit.high))
    assert fit.value[0] == pytest.approx(truth[0], rel=2e-3)
    assert fit.high[0] - fit.low[0] < 0.01 * truth[0]
