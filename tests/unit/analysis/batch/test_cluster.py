"""Through a Dask scheduler: every row once, equal to those of one process, though a worker dies."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.unit.analysis.batch.conftest import write_recording

import rigidimeter as rm

distributed = pytest.importorskip("distributed")


@pytest.fixture
def cluster() -> Iterator:
    """Start a scheduler and two workers, each a process of one thread."""
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as started:
        yield started


@pytest.mark.slow
def test_a_worker_that_is_killed_costs_no_row(tmp_path: Path, cluster, monkeypatch) -> None:
    """It is named, and the inputs are called as they were given, whatever folder workers are in."""
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "archive"
    folder.mkdir()
    for seed in range(12):
        write_recording(folder / f"{seed}.csv", seed)
    (folder / "bad.csv").write_text("time_s,torque_nm\n0,1\n1,2\n")
    alone = rm.batch("archive", tmp_path / "alone.parquet")
    pids = [worker.pid for worker in cluster.workers.values()]
    seen = []

    def progress(share: float) -> None:
        if not seen:
            os.kill(pids[0], signal.SIGKILL)
        seen.append(share)

    addresses = [worker.worker_address for worker in cluster.workers.values()]
    done = rm.batch(
        "archive", tmp_path / "out.parquet", scheduler=cluster.scheduler_address, progress=progress
    )
    assert len(seen) == 13
    assert done.lost_workers == (addresses[0],)
    assert [worker.pid for worker in cluster.workers.values()] != pids  # one was started anew
    assert (done.inputs, done.epochs, done.failed) == (13, 24, alone.failed)
    assert alone.failed[0].startswith("archive/bad.csv has neither column")
    assert done.path.read_bytes() == alone.path.read_bytes()
