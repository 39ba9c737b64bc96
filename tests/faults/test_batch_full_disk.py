"""`batch` on a disk that is really full: a sentence, nothing half written, nothing lost."""

from __future__ import annotations

import pytest
from tests.faults.running_session import fill
from tests.unit.analysis.batch.conftest import write_recording

import rigidimeter as rm
from rigidimeter.core.errors import UserError


def test_a_batch_goes_on_when_there_is_room_again(small_disk, tmp_path):
    for seed in range(3):
        write_recording(tmp_path / f"{seed}.csv", seed, epochs=1)
    named = str(tmp_path / "*.csv")
    plain, out = tmp_path / "plain.parquet", small_disk / "out.parquet"
    rm.batch(named, plain, method="bandlimited")
    parts = small_disk / "out.parquet.parts"
    ballast = fill(small_disk)
    with ballast.open("r+b") as file:  # room for a part, but not for the table
        file.truncate(ballast.stat().st_size - 4096)
    with pytest.raises(UserError, match=r"No space left on device.*give the command again"):
        rm.batch(named, out, method="bandlimited")
    kept = [path for path in parts.iterdir() if path.stat().st_size]
    assert [path.suffix for path in kept] == [".json"]
    assert {path.name for path in small_disk.iterdir()} == {"ballast", parts.name}
    ballast.unlink()
    done = rm.batch(named, out, method="bandlimited")
    assert done.before == 1
    assert out.read_bytes() == plain.read_bytes()
    assert not parts.exists()
