"""Where the real recordings are."""

from pathlib import Path

import pytest
from tests.shared_files import SHARED, skip_without


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Return the folder of real recordings."""
    found = [folder for folder in (SHARED / "data", SHARED) if (folder / "ankle").is_dir()]
    return found[0] if found else skip_without()
