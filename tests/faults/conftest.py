"""Collects what the faults' tests measure; `python -m tests.faults.measure` makes tables of it."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.replayed import sessions_replayed

__all__ = ["sessions_replayed"]

OUT = "RIGIDIMETER_MEASURED"
"""Where the measurements go, one line of JSON each, if anywhere."""


@pytest.fixture
def measured(request):
    """Note from a trial, or as given, how long a reaction took, for one fault on one rig."""

    def note(fault, rig, case="", trial=None, bound_s=None, **times_s):
        if trial is not None:
            times_s = {
                "detected_s": trial.detected_s,
                "zero_s": trial.zero_s,
                "rest_s": trial.rest_s,
                **times_s,
            }
        facts = {"fault": fault, "rig": rig, "case": case, "bound_s": bound_s, **times_s}
        facts["test"] = f"{Path(request.node.path).name}::{request.function.__name__}"
        for name, value in facts.items():
            request.node.user_properties.append(
                (name, value.item() if isinstance(value, np.generic) else value)
            )
        if OUT in os.environ:
            with Path(os.environ[OUT]).open("a", encoding="utf-8") as file:
                file.write(json.dumps(facts) + "\n")

    return note


@pytest.fixture
def small_disk(tmp_path):
    """A file system of its own, small enough to fill."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=1m", "none", str(folder)]
    if subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("mounting a small disk is not permitted here")
    yield folder
    subprocess.run(["umount", "--lazy", str(folder)], check=True)
