"""What the processes of a session load and do first: each starts Python anew."""

import subprocess
import sys

import pytest

from rigidimeter.rig.acquisition.processes import (
    live_estimate,
    loop_process,
    lsl_streams,
    recorder_process,
)

HEAVY = ("scipy.signal", "scipy.stats", "scipy.optimize", "pandas", "pint", "matplotlib")
READING = (
    "pyarrow.parquet",
    "rigidimeter.analysis.reading.formats",
    "rigidimeter.analysis.reading.channels",
)


def test_the_processes_of_a_session_load_nothing_heavy(tmp_path):
    """A subpackage of SciPy costs each process a second, the readers of formats a tenth of one."""
    modules = "rigidimeter.rig.acquisition.processes"
    code = (
        f"import pathlib, sys, {modules}.loop_process, {modules}.recorder, {modules}.supervisor, "
        f"{modules}.live_estimate; from rigidimeter.core.session import sample_log; "
        f"log = sample_log.SampleLog(pathlib.Path({str(tmp_path / 's.arrows')!r}), 10.0); "
        "log.append_columns({name: [0] for name in sample_log.Sample._fields}); log.close(); "
        f"print([name for name in {HEAVY + READING} if name in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"


NAMES = tuple(f"rigidimeter-none-{part}" for part in ("samples", "events", "status"))


@pytest.mark.parametrize(
    ("module", "main", "arguments"),
    [
        (live_estimate, "estimator_main", (None, 1000.0, NAMES, 1.0, 1)),
        (loop_process, "loop_main", (None, None, NAMES, None, None, 1)),
        (lsl_streams, "streamer_main", (None, NAMES, 1.0, 1)),
        (recorder_process, "recorder_main", (None, NAMES, None, 1)),
    ],
)
def test_a_process_whose_session_ended_before_it_began_ends_without_a_word(
    monkeypatch, module, main, arguments
):
    """The console was killed, and the last of the others took the memory with it."""
    monkeypatch.setattr(module, "leave_to_the_others", lambda: None, raising=False)
    monkeypatch.setattr("os.nice", lambda _: 0)
    with pytest.raises(SystemExit) as ended:
        getattr(module, main)(*arguments)
    assert ended.value.code == 1
