"""The real loop on the virtual rig, and sessions to damage: each is simulated once."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.replayed import assert_folder_replayed

from rigidimeter.core.session import Sample
from rigidimeter.core.settings import Settings, parse_settings
from rigidimeter.rig.acquisition import ControlLoop, SimulatedClock, perturb
from rigidimeter.rig.devices import SimulatedRig
from rigidimeter.virtual import run_virtual_session

IDEAL_TORQUE = {"noise_sd_nm": 0.0, "resolution_nm": 0.0}
IDEAL_MOTION = {
    "angle_resolution_deg": 0.0,
    "velocity_resolution_deg_s": 0.0,
    "latency_s": 0.0,
    "stamp_latency_s": 0.0,
}


@pytest.fixture
def noiseless() -> Callable[..., Settings]:
    """Return settings of a rig whose sensors add nothing, with the given tables changed."""

    def settings(*, torque: dict | None = None, rig: dict | None = None, **tables) -> Settings:
        sensors = {"torque": {**IDEAL_TORQUE, **(torque or {})}, "motion": IDEAL_MOTION}
        return parse_settings({"rig": {**sensors, **(rig or {})}, **tables})

    return settings


@pytest.fixture
def run_loop() -> Callable[..., dict[str, np.ndarray]]:
    """Run a perturbation through the real loop and return the columns of its samples."""

    def run(settings: Settings, perturbation_nm: np.ndarray, seed: int = 0):
        rig = SimulatedRig(settings.rig, settings.subject["OFF"], np.random.default_rng(seed))
        rig.enable()
        samples: list[Sample] = []
        loop = ControlLoop(settings, rig, SimulatedClock(), samples.append)
        perturb(loop, 1, perturbation_nm.tolist())
        return {
            name: np.array([getattr(sample, name) for sample in samples]) for name in Sample._fields
        }

    return run


@pytest.fixture(scope="session")
def _kept(tmp_path_factory) -> Callable[[int, int], Path]:
    made: dict[tuple[int, int], Path] = {}

    def folder(epochs: int, seed: int) -> Path:
        if (epochs, seed) not in made:
            protocol = {
                "blocks": [{"task": "prbs", "epochs": epochs}],
                "rests_s": [1.0],
                "return_s": 1.0,
            }
            made[epochs, seed] = tmp_path_factory.mktemp("kept") / "session"
            settings = parse_settings(
                {"seed": seed, "protocol": protocol, "prbs": {"duration_s": 8.0}}
            )
            run_virtual_session(settings, made[epochs, seed])
            assert_folder_replayed(made[epochs, seed])
        return made[epochs, seed]

    return folder


@pytest.fixture
def recorded(tmp_path: Path, _kept) -> Callable[..., Path]:
    """Return a new copy of a virtual session."""

    def copy(*, epochs: int = 1, seed: int = 1, name: str = "session") -> Path:
        return Path(shutil.copytree(_kept(epochs, seed), tmp_path / name))

    return copy
