"""Sessions to damage: each is simulated once, and every test has a copy."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from rigidimeter.core.settings import parse_settings
from rigidimeter.virtual import run_virtual_session


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
        return made[epochs, seed]

    return folder


@pytest.fixture
def recorded(tmp_path: Path, _kept) -> Callable[..., Path]:
    """Return a new copy of a virtual session."""

    def copy(*, epochs: int = 1, seed: int = 1, name: str = "session") -> Path:
        return Path(shutil.copytree(_kept(epochs, seed), tmp_path / name))

    return copy
