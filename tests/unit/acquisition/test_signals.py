"""What is held back from a process that still loads, whatever was started before it."""

from __future__ import annotations

import subprocess
import sys

FIRST_PROCESS = """
import multiprocessing, signal
from rigidimeter.acquisition.processes.end_signals import HELD_BACK, held_back

if __name__ == "__main__":
    process = multiprocessing.get_context("spawn").Process(target=len, args=("",))
    with held_back():
        process.start()
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, ())
    process.join()
    print(sorted(set(HELD_BACK) - blocked))
"""


def test_the_first_process_is_started_with_all_of_them_held_back() -> None:
    # multiprocessing starts its resource tracker before the first process that it spawns, and
    # after that lets SIGINT and SIGTERM through; so only a new interpreter shows it.
    ran = subprocess.run([sys.executable, "-c", FIRST_PROCESS], capture_output=True, text=True)
    assert (ran.stdout.strip(), ran.stderr) == ("[]", "")
