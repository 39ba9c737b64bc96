"""Every example of settings runs: the session of `rigidimeter run`, on a simulated clock."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest
from tests.replayed import assert_folder_replayed

from rigidimeter.cli.realtime_rig import virtual_rig
from rigidimeter.core.session import SessionWriter, read_events
from rigidimeter.core.settings import Settings, changed_settings, load_settings
from rigidimeter.planning import plan
from rigidimeter.rig.acquisition import SessionResult, SimulatedClock, run_session

EXAMPLES = sorted((Path(__file__).parents[3] / "examples" / "settings").glob("*.toml"))


def one_epoch_of_each(settings: Settings) -> Settings:
    """Return the settings with one epoch of each block, and as short a rest as they allow."""
    blocks = [block.model_dump() | {"epochs": 1} for block in settings.protocol.blocks]
    rests_s = [settings.protocol.return_s]
    return changed_settings(settings, {"protocol": {"blocks": blocks, "rests_s": rests_s}})


def run(settings: Settings, folder: Path) -> SessionResult:
    """Run a session that begins with zeroing the torque sensor."""
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    rig, new_joint = virtual_rig(settings, protocol)
    writer = SessionWriter(
        folder,
        settings,
        [asdict(epoch) for epoch in protocol.epochs],
        {"session": settings.seed},
        virtual=True,
        repeatable=True,
    )
    result = run_session(
        protocol,
        settings,
        rig,
        SimulatedClock(),
        writer,
        before_epoch=new_joint,
        zero_first=True,
    )
    assert_folder_replayed(folder)
    return result


@pytest.mark.parametrize("path", EXAMPLES, ids=[path.stem for path in EXAMPLES])
def test_an_example_runs_with_every_epoch_and_its_limits_as_they_are(tmp_path, path):
    settings = one_epoch_of_each(load_settings(path))
    result = run(settings, tmp_path / "session")
    assert (result.outcome, result.reason) == ("success", "")
    assert result.epochs_good == len(settings.protocol.blocks)


def test_the_subject_is_relaxed_while_the_sensor_is_zeroed_and_not_in_the_epochs(tmp_path):
    """The noise found is the sensor's, .005 N·m; the epoch of PRBS has the subject's 1 N·m too."""
    (elbow,) = (path for path in EXAMPLES if path.stem == "human-elbow")
    settings = one_epoch_of_each(load_settings(elbow))
    run(settings, tmp_path / "session")
    events, _ = read_events(tmp_path / "session" / "events.jsonl")
    (zeroed,) = (event for event in events if event["event"] == "sensor_zeroed")
    assert not zeroed["refused"]
    assert zeroed["noise_sd_nm"] == pytest.approx(settings.rig.torque.noise_sd_nm, rel=0.1)
    protocol = plan(settings.protocol, settings.prbs, settings.sinusoid, settings.seed)
    rig, new_joint = virtual_rig(settings, protocol)
    new_joint(protocol.epochs[0])
    rig.enable()
    at_rest_nm = [rig.read().torque_nm for _ in range(10_000)]
    voluntary_nm = settings.subject["OFF"].voluntary_sd_nm
    assert np.std(at_rest_nm) == pytest.approx(voluntary_nm, rel=0.3)
