"""`simulate`: a protocol on the virtual rig as one call."""

from pathlib import Path

import numpy as np
from tests.small_study import tiny

from rigidimeter.analysis.reading import read
from rigidimeter.virtual import simulate


def torques(recording) -> list[np.ndarray]:
    return [epoch.channels["torque_nm"].values for epoch in recording.epochs]


def test_what_is_simulated_is_what_its_folder_holds(tmp_path: Path) -> None:
    settings = tiny("OFF", 3)
    kept = simulate(settings, tmp_path / "session")
    assert [epoch.condition for epoch in kept.epochs] == ["OFF", "OFF"]
    assert all(epoch.virtual for epoch in kept.epochs)
    assert kept.settings == settings
    again = read(tmp_path / "session")
    for ours, theirs in zip(torques(kept), torques(again), strict=True):
        np.testing.assert_array_equal(ours, theirs)


def test_without_a_folder_nothing_stays_and_the_seed_decides(tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    one, same, other = (torques(simulate(tiny("OFF", 3), seed=seed)) for seed in (None, 3, 4))
    np.testing.assert_array_equal(one[0], same[0])
    assert not np.array_equal(one[0], other[0])
    assert list(tmp_path.iterdir()) == []
