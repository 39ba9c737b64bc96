"""SIGKILL in the middle of a session: all but the last tenth of a second comes back."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
from tests.replayed import assert_folder_replayed

from rigidimeter.core.session import read_samples

QUICK = """
[rig]
tick_rate_hz = 250.0
torque.rate_hz = 250.0
motion.rate_hz = 250.0
[sinusoid]
duration_s = 600.0
motion_s = 600.0
[protocol]
blocks = [{ task = "prbs", epochs = 2 }, { task = "sinusoid", epochs = 1 }]
"""
"""The third epoch is simulated for some seconds, in which it is killed."""


def start(folder, *options):
    return subprocess.Popen(
        [sys.executable, "-m", "rigidimeter", "simulate", "--out", str(folder), *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=ignoring,
    )


def ignoring():
    """Ignore what a shell ignores in the background; the program is to obey it all the same."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGQUIT, signal.SIG_IGN)


def wait_for_epoch(folder, number, timeout_s=60.0):
    deadline = time.monotonic() + timeout_s
    while time.monotonic() < deadline:
        events = folder / "events.jsonl"
        if events.exists() and events.read_text().count("epoch_started") >= number:
            return
        time.sleep(0.02)
    pytest.fail(f"epoch {number} did not start within {timeout_s} s")


def quick(tmp_path):
    """Return the options of a session that is simulated, and its settings."""
    (tmp_path / "quick.toml").write_text(QUICK)
    return "--settings", str(tmp_path / "quick.toml")


def test_a_killed_session_comes_back_and_is_analysed(tmp_path, rigidimeter):
    folder = tmp_path / "session"
    process = start(folder, *quick(tmp_path))
    wait_for_epoch(folder, 3)
    while read_samples(folder / "samples.arrows")["epoch"][-1] != 3:
        time.sleep(0.01)
    process.kill()
    process.communicate()
    last_written = read_samples(folder / "samples.arrows")["tick"][-1]

    recovered = rigidimeter("recover", folder, "--reason", "the plug was pulled")
    assert recovered.status == 0, recovered.err
    ticks = read_samples(folder / "samples.arrows")["tick"]
    np.testing.assert_array_equal(ticks, np.arange(last_written + 1))
    closing = [
        json.loads(line)
        for line in (folder / "events.jsonl").read_text().splitlines()
        if "_ended" in line
    ]
    assert closing[-1]["event"] == "session_ended"
    assert closing[-1]["reason"] == "the plug was pulled"
    assert assert_folder_replayed(folder).ticks == last_written + 1

    out = tmp_path / "out.json"
    analysed = rigidimeter("estimate", folder, "--json", out)
    assert analysed.status == 0, analysed.err
    document = json.loads(out.read_text())
    assert [e["outcome"] for e in document["epochs"]] == ["included", "included"]
    assert document["epochs"][0]["stiffness_nm_rad"] == pytest.approx(1.751, rel=0.01)
    (interrupted,) = document["scores"]
    assert interrupted["outcome"] == "excluded"
    assert "the plug was pulled" in interrupted["reason"]


@pytest.mark.realtime(resolves_s=0.1)
def test_in_real_time_at_most_a_tenth_of_a_second_is_lost(tmp_path, lateness):
    folder = tmp_path / "session"
    patient = tmp_path / "patient.toml"  # other programs may hold up this one
    patient.write_text("[loop]\nmissed_in_a_row = 1000\nstall_s = 1.0\n")
    process = start(
        folder, "--task", "prbs", "--epochs", "1", "--real-time", "--settings", str(patient)
    )
    wait_for_epoch(folder, 1)
    started = time.monotonic()
    time.sleep(1.5)
    process.kill()
    ran_s = time.monotonic() - started
    process.communicate()
    samples = read_samples(folder / "samples.arrows")
    # The epoch's event is polled every 20 ms, so the loop had run at least as long as we waited.
    assert samples["time_s"][-1] >= ran_s - 0.1 - 0.02 - lateness.worst_s(started)
    assert_folder_replayed(folder)


@pytest.mark.parametrize(
    "number",
    [
        signal.SIGINT,
        pytest.param(signal.SIGTERM, marks=pytest.mark.slow),
        pytest.param(signal.SIGQUIT, marks=pytest.mark.slow),
    ],
)
def test_an_interrupted_session_closes_in_order(tmp_path, number):
    folder = tmp_path / "session"
    process = start(folder, *quick(tmp_path))
    wait_for_epoch(folder, 2)
    os.kill(process.pid, number)
    _, errors = process.communicate(timeout=30)
    assert process.returncode != 0
    assert "Traceback" not in errors
    events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
    assert events[-1]["event"] == "session_ended"
    assert events[-1]["outcome"] == "abort"
    assert events[-1]["reason"] == "interrupted by the operator"
    # The velocity was ramped to zero before the end.
    assert read_samples(folder / "samples.arrows")["velocity_command_rad_s"][-1] == 0.0
    assert_folder_replayed(folder)
