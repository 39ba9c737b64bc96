"""Through a Dask scheduler: every row once, equal to those of one process, though a worker dies."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.unit.archives.conftest import write_recording

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
def test_a_worker_that_is_killed_costs_no_row(tmp_path: Path, cluster) -> None:
    folder = tmp_path / "archive"
    folder.mkdir()
    for seed in range(12):
        write_recording(folder / f"{seed}.csv", seed)
    alone = rm.batch(folder, tmp_path / "alone.parquet")
    pids = [worker.pid for worker in cluster.workers.values()]
    seen = []

    def progress(share: float) -> None:
        if not seen:
            os.kill(pids[0], signal.SIGKILL)
        seen.append(share)

    done = rm.batch(
        folder, tmp_path / "out.parquet", scheduler=cluster.scheduler_address, progress=progress
    )
    assert len(seen) == 12
    assert [worker.pid for worker in cluster.workers.values()] != pids  # one was started anew
    assert (done.inputs, done.epochs, done.failed) == (12, 24, ())
    assert done.path.read_bytes() == alone.path.read_bytes()
