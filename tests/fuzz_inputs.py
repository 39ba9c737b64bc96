"""The inputs of `tests.fuzz`: sound files of every kind, and the ways to damage them."""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io

from rigidimeter.devices.rigfile import load_rig
from rigidimeter.recording.resume import rest_of
from rigidimeter.settings import parse_settings
from rigidimeter.virtual.virtual_session import run_virtual_session

NUMBERS = (
    *("0", "-1", "nan", "inf", "-inf", "1e-320", "1e308", "-1e308", "1e-300", "5e-324", "true"),
    *("9" * 30, "9" * 400, "9" * 5000, "1e999", "0x10", "[]", "{}", '""', "null", '"1"', "-0.0"),
)
"""What a number is replaced by."""


@dataclass(frozen=True)
class Target:
    """An input: its sound files, the command that reads it, and the file that is changed."""

    name: str
    make: Callable[[Path], None]
    damaged: str
    command: tuple[str, ...]


def columns(n: int = 1200, seed: int = 1) -> dict[str, np.ndarray]:
    """Return a short recording that can be read and fitted."""
    rng = np.random.default_rng(seed)
    angle_rad = np.cumsum(rng.standard_normal(n)) / 500
    torque_nm = 0.05 * angle_rad + 0.001 * rng.standard_normal(n)
    return {"time_s": np.arange(n) / 100, "torque_nm": torque_nm, "angle_rad": angle_rad}


def write_csv(folder: Path) -> None:
    table = columns()
    rows = zip(*table.values(), strict=True)
    text = "\n".join(",".join(map(repr, map(float, row))) for row in rows)
    (folder / "r.csv").write_text(",".join(table) + "\n" + text + "\n")


def _tsv(folder: Path) -> None:
    write_csv(folder)
    text = (folder / "r.csv").read_text().replace(",", "\t")
    (folder / "r.csv").rename(folder / "r.tsv").write_text(text)


def _npz(folder: Path) -> None:
    np.savez_compressed(folder / "r.npz", **columns(), epoch=np.repeat([1, 2], 600))


def _mat(folder: Path) -> None:
    cells = np.array(["a", "bc"], dtype=object)
    more = {"s": {"x": np.arange(5.0), "t": cells}, "label": "OFF"}
    scipy.io.savemat(folder / "r.mat", columns() | more, do_compression=True)


def _mat4(folder: Path) -> None:
    scipy.io.savemat(folder / "r.mat", columns(), format="4")


def _hdf5(folder: Path) -> None:
    import h5py

    with h5py.File(folder / "r.mat", "w", userblock_size=512) as file:
        for name, values in columns().items():
            file.create_dataset(name, data=values, compression="gzip")


def _ratings(folder: Path) -> None:
    rows = [
        f"{condition},{examiner},{(i * i * 3 + 5 * len(condition) * i) % 7 / 2:g},S1,{1 + i % 2}"
        for i, examiner in enumerate("ABCDEF")
        for condition in ("OFF", "DBS")
    ]
    (folder / "r.csv").write_text("condition,examiner,score,subject,day\n" + "\n".join(rows) + "\n")


def _settings(folder: Path) -> None:
    write_csv(folder)
    (folder / "s.toml").write_text(
        "seed = 1\n[prbs]\nclock_hz = 10.0\n[controller]\ninertia_kg_m2 = 0.02\n"
        "[estimation]\nband_low_hz = 0.15\n[protocol]\nrests_s = [1.0]\nreturn_s = 1.0\n"
        'blocks = [{ task = "prbs", epochs = 2, condition = "OFF" }]\n'
    )


def _rig(folder: Path) -> None:
    (folder / "RIG.toml").write_text(
        'name = "a"\nhome_deg = 0.0\n[torque_sensor]\ndriver = "ati-rdt"\naddress = "127.0.0.1"\n'
        '[drive]\ndriver = "cia402"\nchannel = "none"\ninterface = "virtual"\n'
    )


def _session(folder: Path) -> None:
    shutil.copytree(made_session(), folder / "session")


def _old_manifest(folder: Path) -> None:
    """Make a session of version 1, which has no checksum: its values are read as they are."""
    _session(folder)
    path = folder / "session" / "manifest.json"
    values = json.loads(path.read_text())
    values["schema"] = "rigidimeter.session/1"
    values["continues"] = {"folder": "a", "created_utc": "b", "origin_rad": 0.1}
    path.write_text(json.dumps(values, indent=1))


def _study(folder: Path) -> None:
    study = folder / "study"
    study.mkdir()
    (study / "study.toml").write_text(
        'schema = "rigidimeter.study/1"\ntitle = "t"\nreference = "OFF"\nother = "DBS"\n'
        "[conditions.OFF]\nfrequency_hz = 0.0\n[conditions.DBS]\nfrequency_hz = 130.0\n"
        "[rating]\nscale = [0.0, 3.0]\nstep = 0.5\n"
    )
    rows = []
    for number, condition in enumerate(("OFF", "DBS") * 2):
        np.savez(study / f"{number}.npz", **columns(seed=number))
        rows.append(f"{number}.npz,S1,{1 + number // 2},{condition}")
    (study / "sessions.csv").write_text("path,subject,day,condition\n" + "\n".join(rows) + "\n")
    ratings = [f"S1,{d},{c},{e},1.5" for d in (1, 2) for c in ("OFF", "DBS") for e in "AB"]
    text = "subject,day,condition,examiner,score\n" + "\n".join(ratings) + "\n"
    (study / "ratings.csv").write_text(text)


def _estimates(folder: Path) -> None:
    from rigidimeter import estimate, read
    from rigidimeter.recording.estimate_files import write_estimates_json

    paths = [folder / f"{condition}.npz" for condition in ("OFF", "DBS")]
    for seed, path in enumerate(paths):
        np.savez(path, **columns(seed=seed))
    found = estimate(read(paths, condition=["OFF", "DBS"]))
    write_estimates_json(folder / "e.json", found)


def made_session() -> Path:
    """Return a short simulated session, made once for all cases of a process and its children."""
    if not _MADE:
        _MADE.append(Path(tempfile.mkdtemp(prefix="fuzz-")) / "session")
        protocol = {
            "blocks": [{"task": "sinusoid", "epochs": 1}],
            "rests_s": [1.0],
            "return_s": 1.0,
        }
        run_virtual_session(parse_settings({"seed": 1, "protocol": protocol}), _MADE[0])
    return _MADE[0]


_MADE: list[Path] = []
CALLS: Mapping[str, Callable[[Path], object]] = {"load_rig": load_rig, "rest_of": rest_of}
"""What is called by itself, since its command would move a rig."""
TARGETS = (
    Target("text table", write_csv, "r.csv", ("estimate", "r.csv", "--csv", "out/e.csv")),
    Target("tab-separated table", _tsv, "r.tsv", ("estimate", "r.tsv")),
    Target("NumPy archive", _npz, "r.npz", ("estimate", "r.npz", "--json", "out/e.json")),
    Target("MATLAB 5", _mat, "r.mat", ("estimate", "r.mat")),
    Target("MATLAB 4", _mat4, "r.mat", ("estimate", "r.mat")),
    Target("MATLAB 7.3", _hdf5, "r.mat", ("estimate", "r.mat")),
    Target("ratings", _ratings, "r.csv", ("ratings", "r.csv", "--json", "out/r.json")),
    Target(
        "table", _ratings, "r.csv", ("compare", "r.csv", "--value", "score", "--resamples", "100")
    ),
    Target("settings", _settings, "s.toml", ("estimate", "r.csv", "--settings", "s.toml")),
    Target("design", _settings, "s.toml", ("design", "--settings", "s.toml")),
    Target("RIG.toml", _rig, "RIG.toml", ("load_rig", "RIG.toml")),
    Target("manifest", _session, "session/manifest.json", ("estimate", "session")),
    Target("resumed", _old_manifest, "session/manifest.json", ("rest_of", "session")),
    Target("old manifest", _old_manifest, "session/manifest.json", ("estimate", "session")),
    Target("events", _session, "session/events.jsonl", ("estimate", "session")),
    Target("samples", _session, "session/samples.arrows", ("estimate", "session")),
    Target("recover", _session, "session/events.jsonl", ("recover", "session")),
    Target("study.toml", _study, "study/study.toml", ("compare", "study", "--resamples", "100")),
    Target("sessions", _study, "study/sessions.csv", ("compare", "study", "--resamples", "100")),
    Target(
        "study's ratings", _study, "study/ratings.csv", ("compare", "study", "--resamples", "100")
    ),
    Target("estimates", _estimates, "e.json", ("compare", "e.json", "--resamples", "100")),
)
OPTIONS = (
    ("--rate-hz",), ("--epoch-length-s",), ("--band-hz", "0.5"), ("--controller", "0.1"),
    ("--condition",), ("--task",), ("--column",), ("--method",),
)  # fmt: skip
"""Options of `estimate` that get a strange value as their last."""


def mutated(data: bytes, rng: np.random.Generator) -> tuple[str, bytes]:
    """Change a file in one way; return the way and the bytes."""
    ways: Sequence[Callable[[bytes, np.random.Generator], bytes]] = (
        _flip, _cut, _double, _number, _nest, _wide, _long, _encoded, _word,
    )  # fmt: skip
    way = ways[int(rng.integers(len(ways)))]
    return way.__name__.strip("_"), way(data, rng)


def _flip(data: bytes, rng: np.random.Generator) -> bytes:
    changed = bytearray(data)
    for place in rng.integers(0, len(data), int(rng.integers(1, 4))):
        changed[place] ^= 1 << int(rng.integers(8))
    return bytes(changed)


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    start, stop = sorted(int(place) for place in rng.integers(0, len(data), 2))
    return data[:start] + (data[stop:] if rng.random() < 0.5 else b"")


def _double(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    start = int(rng.integers(len(lines)))
    times = int(rng.choice([1, 2, 1000]))
    return b"\n".join([*lines[: start + 1], *lines[start : start + 1] * times, *lines[start + 1 :]])


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    found = list(re.finditer(rb"-?\d+(\.\d+)?(e-?\d+)?", data[:100_000]))
    if not found:
        return _flip(data, rng)
    one = found[int(rng.integers(len(found)))]
    return data[: one.start()] + str(rng.choice(NUMBERS)).encode() + data[one.end() :]


def _nest(data: bytes, rng: np.random.Generator) -> bytes:
    depth = int(rng.choice([40, 5000]))
    opened, closed = [(b"[", b"]"), (b'{"a":', b"}"), (b"a.", b"")][int(rng.integers(3))]
    place = data.find(b" = " if b" = " in data else b": ", int(rng.integers(len(data)))) + 2
    return data[:place] + opened * depth + b"1" + closed * depth + data[place + 1 :]


def _wide(data: bytes, rng: np.random.Generator) -> bytes:
    lines = data.split(b"\n")
    more = b"".join(b",c%d" % k for k in range(int(rng.choice([1, 3000]))))
    every = rng.random() < 0.5
    return b"\n".join(
        line + (more if every or k == 0 else b"") if line else line for k, line in enumerate(lines)
    )


def _long(data: bytes, rng: np.random.Generator) -> bytes:
    times = int(rng.choice([2, 50]))
    head, _, body = data.partition(b"\n")
    return head + b"\n" + body * times


def _encoded(data: bytes, rng: np.random.Generator) -> bytes:
    ways = (
        lambda text: text.encode("utf-16"),
        lambda text: text.encode("utf-32"),
        lambda text: b"\xef\xbb\xbf" + text.encode("latin-1"),
        lambda text: text.replace("\n", "\r").encode("latin-1"),
        lambda text: text.replace("a", "\x1b[2J\x00").encode("latin-1"),
        lambda text: text.replace("e", "\u202e\ud800").encode("utf-8", "surrogatepass"),
    )
    return ways[int(rng.integers(len(ways)))](data.decode("latin-1"))


def _word(data: bytes, rng: np.random.Generator) -> bytes:
    """Replace a value or a word by one of another type."""
    found = list(re.finditer(rb'"[^"\n]*"|\btrue\b|\bfalse\b|\b[A-Za-z]+\b', data[:100_000]))
    if not found:
        return _flip(data, rng)
    one = found[int(rng.integers(len(found)))]
    words = (
        *NUMBERS,
        "=cmd|' /C calc'!A0",
        "../../etc/passwd",
        "/dev/zero",
        "a" * 10_000,
        "\\u001b",
    )
    return data[: one.start()] + str(rng.choice(words)).encode() + data[one.end() :]
