"""One input as rows of the table: one for each epoch, or one that says why there is none.

This runs in the workers. They return rows and nothing else, so a recording is in memory only while
it is estimated.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from rigidimeter.analysis.batch.archive_inputs import Input, content_digest, digest_or_nothing
from rigidimeter.analysis.batch.parts import Row
from rigidimeter.analysis.reading.formats import ReadOptions
from rigidimeter.analysis.reading.recording import read_as
from rigidimeter.analysis.recording import estimate
from rigidimeter.analysis.study import load_recordings, source_of, without_excluded
from rigidimeter.core.errors import UserError
from rigidimeter.core.extensions import load_file
from rigidimeter.core.files import plain_values
from rigidimeter.core.records import Analysis, Epoch, Notice
from rigidimeter.core.settings import Settings, changed_settings, dump_settings
from rigidimeter.core.version import __version__


@dataclass(frozen=True)
class How:
    """How every input is read and estimated.

    Parameters
    ----------
    method : str
    options : ReadOptions
        With the condition of files that do not say one.
    settings : Settings or None
        Instead of those that a recording was made with.
    changes : mapping
        Values that differ from either.
    extensions : mapping of Path to str
        Files that every worker runs first, with their SHA-256.
    version : str
    """

    method: str
    options: ReadOptions
    settings: Settings | None = None
    changes: Mapping[str, Any] = field(default_factory=dict)
    extensions: Mapping[Path, str] = field(default_factory=dict)
    version: str = __version__

    def digest(self, one: Input) -> str:
        """Return the SHA-256 of everything that the rows of an input depend on but its content."""
        said: dict[str, Any] = {
            "method": self.method,
            "options": asdict(self.options),
            "settings": None if self.settings is None else dump_settings(self.settings),
            "changes": self.changes,
            "extensions": [*self.extensions.values()],
        }
        if one.study is not None:
            folder = one.study.folder
            mapping = folder.sessions[0]["mapping"] or folder.about.mapping
            rows = [row.cells for row in (*folder.sessions, *folder.exclusions)]
            said["study"] = {
                "rows": rows,
                "names": asdict(one.study.names),
                "about": folder.about.model_dump(mode="json"),
                "mappings": [digest_or_nothing(folder.folder / mapping) if mapping else ""],
            }
        text = json.dumps(plain_values(said), sort_keys=True, ensure_ascii=False)
        return hashlib.sha256(text.encode()).hexdigest()


def refusal(reason: str) -> list[Row]:
    """Return what stands for an input that gave nothing."""
    return [{"outcome": "failed", "reason": reason}]


def answer(one: Input, digest: str, how: How) -> list[Row]:
    """Read an input, estimate it, and return its rows; whatever goes wrong is a row.

    Parameters
    ----------
    one : Input
    digest : str
        Of its content, before it is read; empty where it could not be read.
    how : How
    """
    if one.refused:
        return refusal(one.refused)
    try:
        for path in how.extensions:
            load_file(path)
        epochs, notices, settings, method = _read(one, how)
        if content_digest(one.path) != digest:
            raise UserError(f"{one.path}: was changed while it was read; run the command again")
        analysis = estimate(epochs, method, settings=changed_settings(settings, how.changes))
    except UserError as error:
        return refusal(" / ".join(error.lines))
    except MemoryError:
        return refusal(f"{one.path}: needs more memory than there is; split it")
    except OSError as error:
        return refusal(f"{error.filename or one.path}: {error.strerror or error}")
    except Exception as error:  # one recording must not end the work on thousands
        return refusal(f"{one.path}: {type(error).__name__}: {error}")
    return [*_rows(epochs, analysis, notices, one)]


def _read(one: Input, how: How) -> tuple[Iterable[Epoch], list[Notice], Settings, str]:
    if how.version != __version__:
        raise UserError(
            f"the worker has rigidimeter {__version__}, and {how.version} was asked for; install "
            "the same version wherever workers run"
        )
    if one.study is None:
        read = read_as({one.path: how.options.condition}, how.options, how.settings)
        return read.epochs, [*read.notices], read.settings, how.method
    folder = one.study.folder
    recordings = load_recordings(folder, one.study.names)
    epochs, _, excluded = without_excluded(folder, recordings)
    method = how.method if how.method != "auto" else folder.about.analysis.method
    settings = how.settings or recordings.settings or Settings()
    return epochs, [*recordings.notices, *excluded], settings, method


def _rows(
    epochs: Iterable[Epoch], analysis: Analysis, notices: Sequence[Notice], one: Input
) -> Iterable[Row]:
    own = str(one.path)
    about: Row = {}
    if one.study is not None:
        session = one.study.folder.sessions[0]
        own = source_of(session["path"])
        about = {"subject": session["subject"], "day": session["day"]}
    told = [n.text.removeprefix(f"{one.path}: ") for n in notices if n.level != "error"]
    about["notices"] = " / ".join(told)
    fits = analysis.rows() if analysis.fits else []
    found = [{**fit, "task": "prbs", "method": analysis.method} for fit in fits]
    found += [{**score.row(), "task": "sinusoid"} for score in analysis.scores]
    order = {(epoch.source, epoch.label): index for index, epoch in enumerate(epochs)}
    for row in sorted(found, key=lambda row: order[row["source"], row["epoch"]]):
        # The same content elsewhere has these rows too.
        inside = row["source"].removeprefix(own)
        cells = plain_values({**row, **about, "source": inside})
        yield {name: cell for name, cell in cells.items() if cell not in (None, "")}
    for notice in notices:
        if notice.level == "error":
            yield {"outcome": "failed", "reason": notice.text}
