"""What the processes of a session load: each starts Python anew, before anything moves."""

import subprocess
import sys

HEAVY = ("scipy.signal", "scipy.stats", "scipy.optimize", "pandas", "pint", "matplotlib")


def test_loop_and_recorder_load_nothing_heavy():
    """A subpackage of SciPy that is imported by name costs each process a second."""
    modules = "rigidimeter.acquisition.processes"
    code = (
        f"import sys, {modules}.loop_process, {modules}.recorder, {modules}.supervise; "
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
