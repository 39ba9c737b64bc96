"""The tutorials, run once for all tests that read what their commands made."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from tests.docs import blocks
from tests.small_study import made_once

import rigidimeter.virtual
from rigidimeter.virtual import StudyDesign, short_design

RIG_125_HZ = {
    "tick_rate_hz": 125.0,
    "torque": {"rate_hz": 125.0},
    "motion": {"rate_hz": 125.0},
}


def eighth(*counts: int) -> StudyDesign:
    """Return the demo at an eighth of its rate: nearly the same is printed, in less time."""
    design = short_design(*counts)
    return replace(design, settings={**design.settings, "rig": RIG_125_HZ})


@pytest.fixture(scope="session")
def ran(tmp_path_factory: pytest.TempPathFactory) -> Callable[[Path], tuple[Path, list[str]]]:
    """Run a tutorial once; return its folder and what is printed otherwise than shown."""

    def run(path: Path) -> tuple[Path, list[str]]:
        def compare(folder: Path) -> Path:
            folder.mkdir()
            shown = blocks.run(path, folder)
            differences = [(one.where, blocks.differs(one.text, one.printed)) for one in shown]
            found = [f"{where}: {why}" for where, why in differences if why]
            (folder / "differences.txt").write_text("\n".join(found), "utf-8")
            return folder

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(rigidimeter.virtual, "short_design", eighth)
            folder = made_once(tmp_path_factory, path.stem, compare)
        return folder, (folder / "differences.txt").read_text("utf-8").splitlines()

    return run
