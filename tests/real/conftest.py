"""Where the real recordings are; they are read in place and never copied."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real recordings, or skip with a sentence that says why."""
    checkout = Path(__file__).resolve().parents[2]
    shared = Path(os.environ.get("RIGIDIMETER_SHARED", checkout.parent / "shared"))
    for folder in (shared / "data", shared):
        if (folder / "ankle").is_dir():
            return folder
    pytest.skip(
        f"the real recordings are not in {shared / 'data'}; set RIGIDIMETER_SHARED to the folder "
        "that holds them to run this test"
    )
