"""Turn a session folder into one of `rigidimeter.session/1`: without checksums and session id."""

import json
from pathlib import Path

import pyarrow as pa

from rigidimeter.core.session import SAMPLE_SCHEMA, read_samples

OLD = ("checksum", "session_id")
BATCH = 100


def as_version_1(folder: Path) -> Path:
    """Rewrite the files of a session as version 1 wrote them."""
    manifest = json.loads((folder / "manifest.json").read_text())
    kept = {name: value for name, value in manifest.items() if name not in OLD}
    kept["schema"] = "rigidimeter.session/1"
    (folder / "manifest.json").write_text(json.dumps(kept, indent=1) + "\n")
    events = folder / "events.jsonl"
    lines = [json.loads(line) for line in events.read_text().splitlines()]
    plain = [{name: v for name, v in line.items() if name not in OLD} for line in lines]
    events.write_text("".join(json.dumps(event) + "\n" for event in plain))
    columns = read_samples(folder / "samples.arrows")
    table = pa.table({name: pa.array(values) for name, values in columns.items()}).cast(
        SAMPLE_SCHEMA
    )
    options = pa.ipc.IpcWriteOptions(compression="lz4")
    with pa.ipc.new_stream(
        str(folder / "samples.arrows"), SAMPLE_SCHEMA, options=options
    ) as stream:
        stream.write_table(table, max_chunksize=BATCH)
    return folder
