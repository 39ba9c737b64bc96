"""Flip single bits in the files of a session, and see what becomes of each.

    python -m tests.faults.flipped_bits [--bits 1500] [--others 500] [--seed 1] [--version 2]

Every session is read and recovered after each flip. A sample is changed unnoticed if one that is
read differs from what was recorded and nothing is said; a refusal is one clear sentence. The status
is 1 if a flip ends otherwise than it may. Version 1 shows what a session without checksums does.
"""

from __future__ import annotations

import argparse
import resource
import shutil
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from tests.version_1 import as_version_1

from rigidimeter.core.errors import UserError
from rigidimeter.core.session import StoredSamples, read_session, recover, scan_samples
from rigidimeter.core.settings import parse_settings
from rigidimeter.virtual import run_virtual_session

FILES = ("samples.arrows", "events.jsonl", "manifest.json")
BATCH = 100
"""Samples of a batch at 1 kHz: the most that one bit may cost."""


@dataclass
class Outcome:
    """What became of the flips in one file."""

    counts: Counter[str] = field(default_factory=Counter)
    most_lost: int = 0
    wrong: list[str] = field(default_factory=list)


def flip_bits(folder: Path, name: str, n_bits: int, rng: np.random.Generator) -> Outcome:
    """Flip `n_bits` bits of one file, one after the other, and put each back."""
    path = folder / name
    whole = path.read_bytes()
    truth = _samples(folder)
    epochs = {epoch.label: epoch for epoch in read_session(folder)[0]}
    outcome = Outcome()
    for bit in rng.choice(8 * len(whole), size=n_bits, replace=False):
        damaged = bytearray(whole)
        damaged[bit // 8] ^= 1 << (bit % 8)
        path.write_bytes(bytes(damaged))
        files = {file: (folder / file).read_bytes() for file in FILES}
        try:
            _judge(folder, truth, epochs, outcome, f"{name}, bit {bit}")
        except UserError:
            outcome.counts["refused"] += 1
        except Exception as error:
            outcome.counts["traceback"] += 1
            outcome.wrong.append(f"{name}, bit {bit}: {type(error).__name__}: {error}")
        for file, content in files.items():
            if (folder / file).read_bytes() != content:
                outcome.counts["touched by recover"] += 1
                (folder / file).write_bytes(content)
        for torn in folder.glob("*.torn"):
            torn.unlink()
    path.write_bytes(whole)
    return outcome


def _samples(folder: Path) -> StoredSamples:
    path = folder / "samples.arrows"
    return scan_samples(path.read_bytes(), path)


def _judge(folder, truth, epochs, outcome, where) -> None:
    """Hold what is read after a flip against what was recorded."""
    found, notices = read_session(folder)
    samples = _samples(folder)
    columns, true = samples.columns, truth.columns
    tick, row = columns["tick"], np.searchsorted(true["tick"], columns["tick"])
    row = np.minimum(row, true["tick"].size - 1)
    changed = np.zeros(tick.size, bool)
    for name, values in columns.items():  # as integers: NaN equals itself, 0.0 differs from -0.0
        bits = f"i{values.itemsize}"
        changed |= values.view(bits) != true[name][row].view(bits)
    lost = true["tick"].size - np.unique(row[~changed]).size
    outcome.most_lost = max(outcome.most_lost, lost)
    noticed = bool(notices)
    outcome.counts["noticed" if noticed else "nothing said"] += 1
    if changed.any():
        outcome.counts["samples changed"] += 1
        outcome.wrong.append(f"{where}: {changed.sum()} samples are read with other values")
    if lost > BATCH or (lost and not noticed):
        outcome.counts["samples lost unnoticed" if not noticed else "more than a batch"] += 1
        outcome.wrong.append(f"{where}: {lost} samples are lost")
    excluded = [epoch for epoch in found if epoch.closed.kind != "included"]
    outcome.counts["epochs excluded"] += len(excluded)
    # A damaged line of events may have said how an epoch ended; damaged samples are left out.
    if len(excluded) > (not where.startswith("samples")):
        outcome.wrong.append(f"{where}: {len(excluded)} epochs are excluded")
    for epoch in found:
        if epoch.closed.kind == "included" and not _same_epoch(epoch, epochs.get(epoch.label)):
            outcome.counts["epoch changed"] += 1
            outcome.wrong.append(f"{where}: epoch {epoch.label} is included, but not as recorded")
        if epoch.left_out:
            outcome.counts["epochs read without a batch"] += 1
    try:
        recover(folder)
    except UserError:
        outcome.counts["recover refuses"] += 1


def _same_epoch(epoch, before) -> bool:
    """Whether every sample that is there was recorded so, and no more lack than are left out."""
    if before is None:
        return False
    most = BATCH if epoch.left_out else 0
    for name, channel in epoch.channels.items():
        recorded = before.channels[name]
        kept = np.isin(recorded.time_s, channel.time_s)
        if np.sum(~kept) > most or not np.array_equal(recorded.values[kept], channel.values):
            return False
    return True


def make_session(folder: Path, version: int = 2) -> Path:
    """Simulate a short session of three epochs."""
    values = {
        "seed": 1,
        "protocol": {
            "blocks": [{"task": "sinusoid", "epochs": 3}],
            "rests_s": [1.0],
            "return_s": 1.0,
        },
        "sinusoid": {"motion_s": 3.0, "duration_s": 4.0},
    }
    run_virtual_session(parse_settings(values), folder)
    return as_version_1(folder) if version == 1 else folder


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.faults.flipped_bits")
    parser.add_argument("--bits", type=int, default=1500, help="in samples.arrows")
    parser.add_argument("--others", type=int, default=500, help="in each other file")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--version", type=int, default=2, choices=(1, 2), help="of the session")
    parser.add_argument("--show", type=int, default=10, help="how many of the wrong ones to print")
    asked = parser.parse_args()
    wrong = 0
    with tempfile.TemporaryDirectory() as temporary:
        folder = make_session(Path(temporary) / "session", asked.version)
        before_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        for name in FILES:
            n_bits = asked.bits if name == FILES[0] else asked.others
            size = (folder / name).stat().st_size
            rng = np.random.default_rng([asked.seed, FILES.index(name)])
            outcome = flip_bits(folder, name, min(n_bits, 8 * size), rng)
            counts = ", ".join(f"{count} {kind}" for kind, count in sorted(outcome.counts.items()))
            print(f"{name} ({size} bytes), {n_bits} bits: {counts}", flush=True)
            print(f"  at most {outcome.most_lost} samples lost, {len(outcome.wrong)} wrong")
            print(*(f"  {line}" for line in outcome.wrong[: asked.show]), sep="\n")
            wrong += len(outcome.wrong)
        after_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        print(f"memory: {before_mb:.0f} MB before, at most {after_mb:.0f} MB")
        shutil.rmtree(folder)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
