"""The golden inputs, by what they show."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from tests.corpus import CORPUS
from tests.golden.case import ANSWER, Case, estimated
from tests.golden.spoiled import SPOILED, as_it_is
from tests.golden.spoiled import write as write_spoiled
from tests.scenarios.catalogue import SCENARIOS
from tests.scenarios.session import write_session
from tests.shared_files import SHARED
from tests.small_study import build, record
from tests.version_1 import as_version_1

ROOT = Path(__file__).parents[2]
SPREAD = ROOT / "examples" / "settings" / "study.toml"
"""Joints that differ from epoch to epoch."""
RATINGS = ROOT / "tests" / "reference" / "mixed" / "scores.csv"

FILES: Mapping[str, tuple[str, Mapping[str, object]]] = {
    "own names": ("CSV with the package's own names", {}),
    "own names, no time": ("a file without a time column", {}),
    "German, Excel": ("decimal commas", {}),
    "row of units": ("units in a row of their own", {}),
    "force with its lever arm": ("a force and its lever arm", {}),
    "volts with their calibration": ("a calibration", {}),
    "foot-pounds and turns a minute": ("units of another system", {}),
    "no units": ("refused: a unit that no file states", {}),
    "degrees stated as rad": ("refused: a unit that contradicts the motion", {}),
    "exchanged": ("refused: torque and angle exchanged", {}),
    "reaction": ("the torque of the joint on the robot", {"reaction": True}),
    "dates": ("time stamps that are dates", {}),
    "the time starts anew with each trial": ("trials in one file", {"column": {"epoch": "Trial"}}),
    "LabVIEW": ("LabVIEW text", {}),
    "OpenSim storage": ("OpenSim", {}),
    "AcqKnowledge": ("AcqKnowledge text", {}),
    "LabChart": ("LabChart text", {}),
    "Vicon Nexus, two rates": (
        "Vicon Nexus",
        {"column": {"angle": "S01:RElbowAngles X", "torque": "S01:RElbowMoment X"}},
    ),
    "Qualisys": ("Qualisys", {}),
    "1.234,5": ("marks between thousands", {}),
    "TDMS waveforms, two clocks": ("TDMS, sensors with different rates", {}),
    "C3D in N·mm": ("C3D", {}),
    "AcqKnowledge, binary": ("BIOPAC", {}),
    "Spike2, two clocks": ("Spike2", {}),
    "pCLAMP": ("Axon", {}),
    "Blackrock with its calibration": ("Blackrock", {}),
    "Plexon with its calibrations": ("Plexon", {}),
    "Excel, German": ("Excel", {}),
    "OpenDocument": ("OpenDocument", {}),
    "NumPy with a rate": ("NPZ", {}),
    "MATLAB structure": ("MATLAB, versions 4 to 7", {}),
    "MATLAB 7.3": ("MATLAB 7.3", {}),
    "MATLAB timetable": ("MATLAB tables and timetables", {}),
    "NWB, two clocks": ("NWB", {}),
    "XDF, two clocks": ("XDF", {}),
    "BIDS-Motion, two clocks": ("BIDS-Motion", {}),
    "Parquet": ("Parquet", {}),
    "Feather": ("Arrow", {}),
    "two files, two clocks": ("one recording in two files", {}),
}
"""Of the corpus of one joint in every format and dialect: what each shows, and further options."""

FINDINGS = {
    "voluntary 0.2 N·m": ("iv", "spectral", "bandlimited", "published"),
    "tremor 1.0 N·m": ("iv", "bandlimited"),
    "cogwheel 0.3 N·m": ("iv",),
    "K step 0.7 to 1.3": ("iv",),
    "K 2:1 by angle": ("iv",),
    "K by phase of movement, ±40 %": ("iv",),
    "K 0.6, 1.2, 0.8, 1.4 by epoch": ("iv",),
    "reflex 60 ms, 0.3": ("bandlimited",),
    "friction in the joint 0.1 N·m": ("iv",),
    "cuff 60 N·m/rad": ("iv",),
    "5 % lost, stamps ±0.3 ms": ("iv",),
    "drive PI 50 Hz with load": ("iv", "bandlimited"),
    "slow position loop 40/s": ("iv",),
    "controller twice the settings": ("iv",),
    "2 % of ticks late, 1 ms": ("iv",),
}
"""Scenarios of the independent simulator, and the methods that are asked."""
CUBIC = "cubic stiffness 40 N·m/rad³"


def _scenario(name: str, folder: Path) -> None:
    epochs, _ = SCENARIOS[name].simulated(0, 4 if "by epoch" in name else 2)
    write_session(folder / "session", epochs, SCENARIOS[name].analysed_with())


def _without_a_person(name: str, folder: Path) -> None:
    """A reflex is not looked for, so that what it does has no name."""
    epochs, _ = SCENARIOS[name].simulated(0, 2)
    settings = SCENARIOS[name].analysed_with()
    checks = settings.diagnostics.model_copy(update={"subject_present": False})
    write_session(folder / "session", epochs, settings.model_copy(update={"diagnostics": checks}))


def _torque_and_angle(name: str, folder: Path) -> None:
    (epoch,) = SCENARIOS[name].simulated(0, 1).epochs
    channels = [epoch.channels[one] for one in ("torque_nm", "angle_rad")]
    columns = {one.name: one.values for one in channels}
    np.savez(folder / "session.npz", time_s=channels[0].time_s, **columns)


def _of_files() -> Iterator[Case]:
    for name, (shows, more) in FILES.items():
        entry = CORPUS[name]
        command = estimated(*entry.files, **entry.said, **more)
        yield Case(f"file: {name}", f"reading: {shows}", entry.write, [command])


def _of_findings() -> Iterator[Case]:
    for name, methods in FINDINGS.items():
        for method in methods:
            yield Case(
                f"joint: {name}, {method}",
                f"method {method}",
                partial(_scenario, name),
                [estimated("session", method=method)],
            )

    for name, makes, file, method in (
        ("reflex 35 ms, 0.05", _without_a_person, "session", "iv"),
        ("cuff 60 N·m/rad", _torque_and_angle, "session.npz", "bandlimited"),
    ):
        yield Case(
            f"joint: {name}, {makes.__name__[1:].replace('_', ' ')}",
            f"method {method}",
            partial(makes, name),
            [estimated(file, method=method)],
        )


def _of_spoiled() -> Iterator[Case]:
    for name, (change, options) in SPOILED.items():
        yield Case(
            f"epoch: {name}",
            "checks of an epoch",
            lambda folder, change=change: write_spoiled(folder / "elbow.npz", change),
            [estimated("elbow.npz", **options)],
        )
    limb = "[diagnostics]\ngravity_nm = 0.4\ngravity_angle_deg = 30.0\n"

    def weighed(folder: Path) -> None:
        write_spoiled(folder / "elbow.npz", as_it_is)
        (folder / "limb.toml").write_text(limb)

    command = estimated("elbow.npz", settings="limb.toml")
    yield Case("epoch: the limb's weight", "K without gravity", weighed, [command])


SESSION = """\
seed = {seed}
[protocol]
rests_s = [1.0]
return_s = 1.0
[[protocol.blocks]]
task = "{task}"
condition = "OFF"
epochs = 2
"""
PUSHING = "[subject.OFF]\nvoluntary_sd_nm = 0.2\n"
SLOW = "[guard]\nspeed_limit_deg_s = 12.0\n"
NARROW = "[guard]\nposition_limit_deg = 10.0\n[sinusoid]\namplitude_deg = 5.0\n"
SINUSOID = "[sinusoid]\nmotion_s = 6.0\nduration_s = 7.0\n[scores]\ncycles = 4\n"


def _session(name: str, shows: str, text: str, *more: object, task: str = "prbs") -> Case:
    """Return a session of the virtual rig and its estimates."""

    def write(folder: Path) -> None:
        (folder / "rig.toml").write_text(SESSION.format(seed=7, task=task) + text)

    simulated = ["simulate", "--settings", "rig.toml", "--out", "session"]
    return Case(
        f"session: {name}", shows, write, [simulated, *more, estimated("session")]
    )  # fmt: skip


def _damaged(folder: Path) -> None:
    path = record(folder / "session", "OFF", 5) / "samples.arrows"
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 0xFF
    path.write_bytes(content)


def _cut_off(folder: Path) -> None:
    session = record(folder / "session", "OFF", 5)
    samples = session / "samples.arrows"
    samples.write_bytes(samples.read_bytes()[: int(0.8 * samples.stat().st_size)])
    events = session / "events.jsonl"
    events.write_text("".join(events.read_text().splitlines(keepends=True)[:-3]))


def _of_sessions() -> Iterator[Case]:
    yield _session("relaxed", "simulate", "")
    yield _session("who pushes", "simulate, a subject who pushes", PUSHING)
    yield _session("at its limits", "the guard's limits", NARROW)
    yield _session("slowed by the guard", "the guard's limits", SLOW)
    yield _session("imposed sinusoids", "impulse and work", SINUSOID, task="sinusoid")
    yield Case("session: a flipped byte", "damaged sessions", _damaged, [estimated("session")])
    yield Case(
        "session: interrupted", "recover", _cut_off,
        [["recover", "session"], estimated("session")],
    )  # fmt: skip
    yield Case(
        "session: of version 1", "session folders of version 1",
        lambda folder: as_version_1(record(folder / "session", "OFF", 5)), [estimated("session")],
    )  # fmt: skip
    exported = lambda folder: record(folder / "session", "OFF", 5)  # noqa: E731
    yield Case(
        "session: not exported", "what exports are compared with", exported, [estimated("session")]
    )
    tables = [f"tables/{name}.parquet" for name in ("torque", "motion", "control")]
    for form, path, files, said in (
        ("nwb", "s.nwb", ["s.nwb"], {}),
        ("bids", "bids", ["bids"], {}),
        ("mat", "s.mat", ["s.mat"], {}),
        ("parquet", "tables", tables, {"join": True}),
    ):
        export = ["export", "session", "--to", form, "--out", path, "--subject", "S1", "--day", "1"]
        yield Case(
            f"session: through {form}", f"export to {form} and back", exported,
            [export, estimated(*files, **said)],
        )  # fmt: skip
    yield Case(
        "session: one mapping for many", "inspect, mapping files", CORPUS["volts"].write,
        [
            ["inspect", "r.csv", "--scale", "torque=2.5 Nm/V", "--offset", "torque=0.1 V",
             "--write-mapping", "lab.toml"],
            estimated("r.csv", mapping="lab.toml"),
        ],
    )  # fmt: skip
    yield Case(
        "session: an archive", "batch", _archive,
        [["batch", "archive", "--out", "answer.csv"]], "answer.csv",
    )  # fmt: skip


def _archive(folder: Path) -> None:
    (folder / "archive").mkdir()
    for number, name in enumerate(("own names", "German, Excel", "no units")):
        place = folder / "archive" / str(number)
        place.mkdir()
        CORPUS[name].write(place)


def _cohort(folder: Path) -> None:
    """Write a study of four subjects, each recorded once in each condition."""
    study = folder / "study"
    rows = ["path,subject,day,condition"]
    (study / "sessions").mkdir(parents=True)
    for number in range(4):
        size = 0.8 + 0.15 * number
        for condition, share in (("OFF", 1.0), ("DBS", 0.8)):
            joint = {"damping_nm_s_rad": 0.14 * share, "stiffness_nm_rad": 1.75 * size * share}
            path = f"sessions/S{number}-{condition}"
            record(study / path, condition, 10 * number, subject={condition: joint})
            rows.append(f"{path},S{number},1,{condition}")
    (study / "sessions.csv").write_text("\n".join(rows) + "\n")
    (study / "study.toml").write_text(
        'schema = "rigidimeter.study/1"\ntitle = "Cohort"\nreference = "OFF"\nother = "DBS"\n'
    )


def _two_days(folder: Path) -> None:
    for seed, condition in enumerate(("OFF", "DBS")):
        record(folder / condition, condition, seed, epochs=4)


def _of_studies() -> Iterator[Case]:
    draws = ("--resamples", "499")
    for task in ("prbs", "sinusoid"):
        yield Case(
            f"study: days, {task}", "compare, by days", lambda folder, task=task: build(
                folder / "study", task
            ), [["compare", "study", *draws, "--json", ANSWER]], left_out=(),
        )  # fmt: skip
    yield Case(
        "study: four subjects", "compare, by subjects", _cohort,
        [["compare", "study", *draws, "--json", ANSWER]],
    )  # fmt: skip
    yield Case(
        "study: two recordings", "compare, one session of each condition", _two_days,
        [["compare", "OFF", "DBS", *draws, "--json", ANSWER]],
    )  # fmt: skip
    rated = ["unbalanced", "three", "nested", "crossed"]
    for name in rated:
        random = {"nested": "subject/day", "crossed": "subject"}.get(name)
        more = ["--random", "examiner", "--random", random] if random else []
        yield Case(
            f"study: ratings, {name}", "ratings", lambda folder, name=name: _ratings(folder, name),
            [["ratings", "scores.csv", *more, "--scale", "-10", "10", "--step", "0",
              "--json", ANSWER]],
        )  # fmt: skip
    yield Case(
        "study: a column of a table", "compare, a column of any table",
        lambda folder: _ratings(folder, "crossed"),
        [["compare", "scores.csv", "--value", "score", "--session", "subject", *draws,
          "--json", ANSWER]],
    )  # fmt: skip


def _ratings(folder: Path, name: str) -> None:
    with RATINGS.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row.pop("dataset") == name]
    lines = [",".join(rows[0]), *(",".join(row.values()) for row in rows)]
    (folder / "scores.csv").write_text("\n".join(lines) + "\n")


def _of_plans() -> Iterator[Case]:
    nothing = lambda folder: None  # noqa: E731
    wanted = ("--detect", "damping=20%", "--detect", "stiffness=0.3")
    yield Case(
        "design: the paper's rig", "design: stability, standard errors, days needed", nothing,
        [["design", "--settings", SPREAD, *wanted, "--json", ANSWER]],
    )  # fmt: skip
    yield Case(
        "design: searched", "design --optimise, --multisine", nothing,
        [["design", "--optimise", "--multisine", "--json", ANSWER]],
    )  # fmt: skip
    yield Case(
        "model: terms selected", "model --compare", partial(_scenario, CUBIC),
        [["model", "session", "--compare", "--json", ANSWER]], left_out=("models",),
    )  # fmt: skip
    yield Case(
        "model: named terms", "model --terms", partial(_scenario, CUBIC),
        [["model", "session", "--terms", "inertia,damping,stiffness,cubic", "--json", ANSWER]],
    )  # fmt: skip


def _of_others() -> Iterator[Case]:
    ankle = SHARED / "data" / "ankle" / "z_pf.npz"
    columns = ("--column", "angle_rad=position_rad", "--column", "torque_nm=torque_Nm")
    for method in ("bandlimited", "published"):
        yield Case(
            f"measured: an ankle, {method}", "recordings of others", lambda folder: None,
            [["estimate", ankle, *columns, "--rate-hz", "1000", "--reaction",
              "--epoch-length-s", "20", "--method", method, "--json", ANSWER]],
            needs=ankle,
        )  # fmt: skip


CASES: dict[str, Case] = {
    case.name: case
    for family in (
        _of_files, _of_findings, _of_spoiled, _of_sessions, _of_studies, _of_plans, _of_others
    )
    for case in family()
}  # fmt: skip
