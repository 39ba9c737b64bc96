"""`data`: small virtual recordings that are installed with the package.

`python -m tests.example_data` makes the files from the virtual rig.
"""

from __future__ import annotations

from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any, Literal, overload

from rigidimeter.analysis.reading.formats.table import nearest
from rigidimeter.analysis.reading.recording import Recording, read
from rigidimeter.core.errors import UserError

STUDY = "study"
"""The one that is a study folder."""


class Listed(dict[str, str]):
    """What there is by name; it prints as one line each, and as a table in a notebook."""

    def __repr__(self) -> str:
        width = max(map(len, self))
        return "\n".join(f"{name:<{width}}  {text}" for name, text in self.items())

    def _repr_html_(self) -> str:
        rows = (f"<tr><td>{n}</td><td>{escape(text)}</td></tr>" for n, text in self.items())
        return f"<table>{''.join(rows)}</table>"


EXAMPLES = Listed(
    {
        "elbow": "the paper's small joint, relaxed: 3 PRBS epochs in OFF and 3 in DBS",
        "pushing": "the subject pushes with 0.2 N·m (SD): least squares is biased",
        "tremor": "a tremor of 0.3 N·m at 5 Hz",
        "reflex": "a reflex of 0.3 N·m·s/rad, 60 ms late, beside J, B and K",
        "sinusoids": "sinusoids of 20° at 1 Hz, 3 epochs in OFF and 3 in DBS: impulse and work",
        STUDY: "a study folder: 8 days, each with OFF and DBS, ratings of three examiners",
    }
)
"""One line for each name."""

FOLDER = Path(str(files("rigidimeter") / "example_data"))


@overload
def data(name: None = None) -> Listed: ...
@overload
def data(name: Literal["study"]) -> Path: ...
@overload
def data(name: Literal["elbow", "pushing", "tremor", "reflex", "sinusoids"]) -> Recording: ...
@overload
def data(name: str) -> Any: ...


def data(name: str | None = None) -> Listed | Recording | Path:
    """Return example data by name: a recording, or the folder of a study.

    The data are installed with the package; nothing is downloaded. All are virtual, from a
    simulated subject, and estimates and reports of them say so. Epochs last 10 s; torque and angle
    were sampled together, at 1000 samples/s, in the study at 200. J is 0.0045 kg·m², B 0.1368 in
    OFF and 0.119 N·m·s/rad in DBS, K 1.751 and 1.44 N·m/rad; in the study these are the medians.

    Parameters
    ----------
    name : str, optional
        One of the names that `data()` lists.

    Returns
    -------
    Listed
        Without a name: what there is, one line each, by name.
    Recording
        As of `read`, for `estimate`, `report` and its own `plot`.
    Path
        Of ``"study"``: its folder, for `compare` and `report`. Copy the folder before you change
        it, or analyse it with the command line, which writes into a study.

    Raises
    ------
    UserError
        If there is no such name.

    Examples
    --------
    >>> import rigidimeter as rm
    >>> list(rm.data())
    ['elbow', 'pushing', 'tremor', 'reflex', 'sinusoids', 'study']
    >>> estimates = rm.estimate(rm.data("elbow"))
    >>> [f"{one.condition} {one.stiffness_nm_rad:.2f} N·m/rad" for one in estimates.pooled[:2]]
    ['OFF 1.75 N·m/rad', 'DBS 1.44 N·m/rad']
    >>> (rm.data("study") / "sessions.csv").exists()
    True
    """
    if name is None:
        return Listed(EXAMPLES)
    if not isinstance(name, str) or name not in EXAMPLES:
        near = nearest(name, EXAMPLES, least=0.6) if isinstance(name, str) else ""
        asked = f"; did you mean {near}?" if near else ""
        raise UserError(
            f"no example data are named {name!r}: there are {', '.join(EXAMPLES)}{asked}"
        )
    return FOLDER / STUDY if name == STUDY else read(FOLDER / f"{name}.parquet")
