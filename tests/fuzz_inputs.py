"""The inputs of `tests.fuzz`: sound files of every kind, and the commands that read them."""

from __future__ import annotations

import json
import shutil
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.io
from numpy.typing import ArrayLike
from tests.fuzz_files import FILES
from tests.replayed import assert_folder_replayed
from tests.version_1 import as_version_1

from rigidimeter.core.session import rest_of
from rigidimeter.core.settings import parse_settings
from rigidimeter.rig.devices import load_rig
from rigidimeter.virtual import run_virtual_session


@dataclass(frozen=True)
class Target:
    """An input: its sound files, the command that reads it, and the file that is changed."""

    name: str
    make: Callable[[Path], None]
    damaged: str
    command: tuple[str, ...]


@dataclass(frozen=True)
class Archive(Target):
    """A file of arrays, one of which may be strange."""

    save: Callable[[Path, Mapping[str, ArrayLike]], None]


def _archive(name: str, suffix: str, save: Callable[..., None], *more: str) -> Archive:
    def make(folder: Path) -> None:
        save(folder / f"r{suffix}", columns())

    return Archive(name, make, f"r{suffix}", ("estimate", f"r{suffix}", *more), save)


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


def _npz(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    np.savez_compressed(path, **{name: np.asarray(each) for name, each in arrays.items()})


def _mat(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    cells = np.array(["a", "bc"], dtype=object)
    more = {"s": {"x": np.arange(5.0), "t": cells}, "label": "OFF"}
    scipy.io.savemat(path, {**arrays, **more}, do_compression=True)
    data = path.read_bytes()
    path.write_bytes(b"MATLAB 5.0 MAT-file".ljust(116) + data[116:])  # without the time of day


def _mat4(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    scipy.io.savemat(path, dict(arrays), format="4")


def _hdf5(path: Path, arrays: Mapping[str, ArrayLike]) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in arrays.items():
            packed = {"compression": "gzip"} if np.ndim(values) else {}
            file.create_dataset(name, data=values, **packed)


def _ratings(folder: Path) -> None:
    rows = [
        f"{condition},{examiner},{(i * i * 3 + 5 * k * i + day) % 7 / 2:g},S1,{day}"
        for i, examiner in enumerate("ABCDEF")
        for k, condition in enumerate(("OFF", "DBS"))
        for day in (1, 2)
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


def _old_session(folder: Path) -> None:
    """Make a session of version 1, whose events and samples have no checksums either."""
    if len(_MADE) < 2:
        _MADE.append(made_session().with_name("old"))
        as_version_1(Path(shutil.copytree(made_session(), _MADE[1])))
    shutil.copytree(_MADE[1], folder / "session")


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
    from rigidimeter.analysis.reading.estimate_files import write_estimates_json

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
        assert_folder_replayed(_MADE[0])
    return _MADE[0]


_MADE: list[Path] = []
CALLS: Mapping[str, Callable[[Path], object]] = {"load_rig": load_rig, "rest_of": rest_of}
"""What is called by itself, since its command would move a rig."""
TARGETS = (
    Target("text table", write_csv, "r.csv", ("estimate", "r.csv", "--csv", "out/e.csv")),
    Target("tab-separated table", _tsv, "r.tsv", ("estimate", "r.tsv")),
    _archive("NumPy archive", ".npz", _npz, "--json", "out/e.json"),
    _archive("MATLAB 5", ".mat", _mat),
    _archive("MATLAB 4", ".mat", _mat4),
    _archive("MATLAB 7.3", ".mat", _hdf5),
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
    Target("old events", _old_session, "session/events.jsonl", ("estimate", "session")),
    Target("old samples", _old_session, "session/samples.arrows", ("estimate", "session")),
    Target("old recover", _old_session, "session/samples.arrows", ("recover", "session")),
    Target("study.toml", _study, "study/study.toml", ("compare", "study", "--resamples", "100")),
    Target("sessions", _study, "study/sessions.csv", ("compare", "study", "--resamples", "100")),
    Target(
        "study's ratings", _study, "study/ratings.csv", ("compare", "study", "--resamples", "100")
    ),
    Target("estimates", _estimates, "e.json", ("compare", "e.json", "--resamples", "100")),
    *(Target(*made) for made in FILES),
)
OPTIONS = (
    ("--rate-hz",), ("--epoch-length-s",), ("--band-hz", "0.5"), ("--controller", "0.1"),
    ("--condition",), ("--task",), ("--column",), ("--method",),
)  # fmt: skip
"""Options of `estimate` that get a strange value as their last."""
