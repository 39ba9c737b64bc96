"""A study that a test spoils, as `rigidimeter compare` sees it."""

import json

import pytest


@pytest.fixture
def compared(rigidimeter, study):
    """Compare the study; return status, what was printed, and the kept comparison if any."""

    def run(*options: object):
        ran = rigidimeter("compare", study, "--resamples", 100, *options)
        assert "Traceback" not in ran.err
        kept = study / "analysis/comparison.json"
        return ran, json.loads(kept.read_text()) if kept.exists() else None

    return run


def errors(err: str) -> list[str]:
    return [line for line in err.splitlines() if line.startswith(("error", "rigidimeter:"))]


def only_error(ran, *pieces: str) -> None:
    """Assert that one error holds these pieces, and that the rest was analysed."""
    (line,) = errors(ran.err)
    for piece in pieces:
        assert piece in line
    assert ran.status == 1
    assert "\n impulse, N·m·s" in ran.out
