"""Makes the data that are installed with the package: `python -m tests.example_data`.

All but the reflex come from the virtual rig, through session folders; its subject has no reflexes,
so that one comes from the independent rig of `tests.scenarios`. Perturbation, velocity command,
torque and angle are written to Parquet as float32, on the clock of the sensors. Nothing is filtered
or resampled: the sensors of the study have 200 samples/s. The study and the sinusoids have no
command, for their size.
"""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet
from tests.scenarios.scenario import scenario

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.reading.example_data import EXAMPLES, FOLDER, STUDY
from rigidimeter.analysis.reading.formats.arrow_file import VIRTUAL
from rigidimeter.core.files import write_text
from rigidimeter.core.records import Epoch
from rigidimeter.virtual import (
    short_design,
    simulate,
    write_virtual_study,
)

SEED = 1
EPOCH_S = 10.0
STUDY_RATE_HZ = 200.0
REST_S = 1.0
"""Between two epochs on the clock of the table; nothing is written of it."""

UNITS = {
    "time_s": "s", "perturbation_nm": "N·m", "velocity_command_rad_s": "rad/s",
    "torque_nm": "N·m", "angle_rad": "rad",
}  # fmt: skip

JOINTS: Mapping[str, Mapping[str, float]] = {
    "OFF": {"damping_nm_s_rad": 0.1368, "stiffness_nm_rad": 1.751},
    "DBS": {"damping_nm_s_rad": 0.119, "stiffness_nm_rad": 1.44},
}
"""The same in each epoch, with J 0.0045 kg·m²; in the study they are the medians of all days."""


def _protocol(
    epochs: Mapping[str, int], task: str = "prbs", subject: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """Return settings of one recording."""
    return {
        "seed": SEED,
        "prbs": {"duration_s": EPOCH_S},
        "sinusoid": {"duration_s": EPOCH_S},
        "subject": {
            name: {**JOINTS[name], "voluntary_sd_nm": 0.01, **(subject or {})} for name in epochs
        },
        "protocol": {
            "blocks": [
                {"task": task, "condition": name, "epochs": n} for name, n in epochs.items()
            ],
            "rests_s": [1.0],
            "return_s": 1.0,
        },
    }


BOTH = {"OFF": 3, "DBS": 3}
SETTINGS = {
    "elbow": _protocol(BOTH),
    "pushing": _protocol({"OFF": 3}, subject={"voluntary_sd_nm": 0.2}),
    "tremor": _protocol({"OFF": 3}, subject={"tremor_amplitude_nm": 0.3}),
    "sinusoids": _protocol(BOTH, "sinusoid"),
}
"""Of each recording on the virtual rig."""

REFLEX = scenario(
    "reflex",
    joint={"reflex_nm_s_rad": 0.3, "reflex_delay_s": 0.06},
    perturbation={"duration_s": EPOCH_S},
)


def study_design():
    """Return the design of the study: 3 PRBS epochs and a sinusoidal one a day and condition."""
    design = short_design(8, 3, 1)
    sensors = {name: {"rate_hz": STUDY_RATE_HZ} for name in ("torque", "motion")}
    return replace(design, settings={**design.settings, "rig": sensors})


def table_of(epochs: Iterable[Epoch], text: str) -> pa.Table:
    """Return epochs as one table, one after the other."""
    parts: list[dict[str, Any]] = []
    began_s = 0.0
    for epoch in epochs:
        channels = epoch.channels
        time_s = channels["angle_rad"].time_s
        assert np.array_equal(channels["torque_nm"].time_s, time_s), "one clock for both sensors"
        values: dict[str, Any] = {"time_s": np.round(began_s + time_s - time_s[0], 6)}
        for name in (name for name in UNITS if name in channels):
            held = channels[name]  # the newest of the loop, as the sensors see it
            newest = np.searchsorted(held.time_s, time_s + 1e-9, side="right") - 1
            values[name] = held.values[np.clip(newest, 0, None)].astype(np.float32)
        values.setdefault("perturbation_nm", np.zeros(time_s.size, np.float32))  # of a sinusoid
        labels = {"epoch": epoch.label, "condition": epoch.condition, "task": epoch.task}
        parts.append(values | {name: [text] * time_s.size for name, text in labels.items()})
        began_s = parts[-1]["time_s"][-1] + REST_S
    columns = {
        name: pa.array(np.concatenate([part[name] for part in parts]))
        if name in UNITS
        else pa.array([label for part in parts for label in part[name]]).dictionary_encode()
        for name in parts[0]
    }
    fields = [
        pa.field(name, column.type, metadata={"unit": UNITS[name]} if name in UNITS else None)
        for name, column in columns.items()
    ]
    about = {VIRTUAL: b"true", b"description": text.encode()}
    return pa.Table.from_arrays([*columns.values()], schema=pa.schema(fields, metadata=about))


def _without_command(epoch: Epoch) -> Epoch:
    names = {*UNITS} - {"velocity_command_rad_s"}
    return replace(epoch, channels={k: v for k, v in epoch.channels.items() if k in names})


def recording(name: str) -> pa.Table:
    """Return one of the recordings."""
    if name == "reflex":
        return table_of(REFLEX.simulated(SEED, 3).epochs, EXAMPLES[name])
    epochs = simulate(SETTINGS[name]).epochs
    return table_of(
        epochs if name != "sinusoids" else map(_without_command, epochs), EXAMPLES[name]
    )


def day(session: Path) -> pa.Table:
    """Return a session of the study."""
    epochs = map(_without_command, read(session).epochs)
    return table_of(epochs, f"{EXAMPLES[STUDY]}: {session.name}")


def write(table: pa.Table, path: Path) -> None:
    """Write a table as small as it goes."""
    dense = {"time_s", "velocity_command_rad_s", "angle_rad"} & {*table.column_names}
    split = {name: "BYTE_STREAM_SPLIT" for name in dense}
    pa.parquet.write_table(
        table,
        path,
        compression="zstd",
        compression_level=19,
        use_dictionary=[name for name in table.column_names if name not in split],
        column_encoding=split,
        write_statistics=False,
    )


def main() -> None:
    """Make all of them anew."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    (FOLDER / STUDY).mkdir(parents=True)
    for name in (name for name in EXAMPLES if name != STUDY):
        write(recording(name), FOLDER / f"{name}.parquet")
    with tempfile.TemporaryDirectory() as place:
        made = Path(place) / STUDY
        plans = write_virtual_study(made, study_design(), SEED)
        for name in ("study.toml", "ratings.csv"):
            shutil.copy(made / name, FOLDER / STUDY)
        for plan in plans:
            write(day(made / plan.folder), FOLDER / STUDY / f"{Path(plan.folder).name}.parquet")
        sessions = (made / "sessions.csv").read_text("utf-8")
    for plan in plans:
        sessions = sessions.replace(plan.folder, f"{Path(plan.folder).name}.parquet")
    write_text(FOLDER / STUDY / "sessions.csv", sessions)
    sizes = [path.stat().st_size for path in FOLDER.rglob("*") if path.is_file()]
    print(f"{len(sizes)} files, {sum(sizes) / 1e6:.2f} MB")


if __name__ == "__main__":
    main()
