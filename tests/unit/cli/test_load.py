"""An estimator or a term from outside the package: one file, given to --load."""

import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from rigidimeter.estimation import METHODS
from rigidimeter.estimation.terms import TERMS

ESTIMATOR = '''
import numpy as np

from rigidimeter.estimation import METHODS, Method
from rigidimeter.records import Fit, Outcome


def guess(epochs, inertia_kg_m2, progress, pooled):
    """Say the same of every joint."""
    value = np.array([0.004 if inertia_kg_m2 is None else inertia_kg_m2, 0.1, 1.5])

    def fit(epoch):
        progress(1.0)
        return Fit(epoch.source, epoch.label, epoch.condition, "toy", Outcome(), value,
                   np.zeros(3), value, value, np.zeros(3), n_samples=1000, r_squared=0.9)

    return [fit(prepared.epoch) for prepared in epochs], []


METHODS.append(Method("toy", "a guess", (), "by a guess of ours", guess))
'''


@pytest.fixture
def estimator(tmp_path: Path) -> Iterator[Path]:
    """Write the estimator to a file; forget it afterwards."""
    known = METHODS[:]
    path = tmp_path / "toy_estimator.py"
    path.write_text(ESTIMATOR)
    yield path
    METHODS[:] = known


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    t = np.arange(8000) / 400.0
    w = 2 * np.pi * np.arange(0.2, 20.0, 0.35)
    phase = np.outer(w, t) + np.random.default_rng(1).uniform(0, 2 * np.pi, w.size)[:, None]
    size = 0.05 / (1 + w)
    x, v, a = size @ np.sin(phase), (size * w) @ np.cos(phase), -(size * w**2) @ np.sin(phase)
    table = np.column_stack([t, 0.0045 * a + 0.14 * v + 1.7 * x, x])
    path = tmp_path / "joint.csv"
    header = "time_s,torque_nm,angle_rad"
    np.savetxt(path, table, "%.17g", delimiter=",", header=header, comments="")
    return path


def test_the_help_names_it(rigidimeter, estimator):
    assert "toy (a guess)" not in rigidimeter("estimate", "--help").out
    ran = rigidimeter("--load", estimator, "estimate", "--help")
    assert "toy (a guess)" in " ".join(ran.out.split())
    assert "bandlimited (least squares" in " ".join(ran.out.split())


def test_estimate_and_report_use_it(rigidimeter, estimator, recording, tmp_path):
    chosen = ["--method", "toy", recording]
    ran = rigidimeter("estimate", *chosen)
    assert ran.status == 1
    assert "known: auto, published, bandlimited, iv, spectral, ml" in ran.err
    ran = rigidimeter("--load", estimator, "estimate", *chosen, "--json", tmp_path / "e.json")
    assert ran.status == 0, ran.err
    document = json.loads((tmp_path / "e.json").read_text())
    assert document["method"] == "toy"
    assert document["epochs"][0]["stiffness_nm_rad"] == 1.5
    ran = rigidimeter("report", *chosen, "--out", tmp_path / "report")
    assert ran.status == 0, ran.err
    assert "a guess" in (tmp_path / "report" / "report.html").read_text("utf-8")


def test_a_term_of_the_torque_is_one_entry(rigidimeter, recording, tmp_path, monkeypatch):
    monkeypatch.setattr("rigidimeter.estimation.terms.catalogue.TERMS", TERMS[:])
    path = tmp_path / "quintic.py"
    path.write_text(
        "from rigidimeter.estimation.terms.catalogue import TERMS, Term\n"
        "TERMS.append(Term('quintic', 'N·m/rad⁵', 'A spring.', lambda m: m.angle_rad**5))\n"
    )
    assert "quintic" in rigidimeter("--load", path, "model", "--help").out
    ran = rigidimeter("--load", path, "model", recording, "--terms", "stiffness,quintic")
    assert ran.status == 0, ran.err
    assert "N·m/rad⁵" in ran.out


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("absent.py", None, "absent.py: there is no such file"),
        ("bad.py", "1 / 0", "bad.py: ZeroDivisionError: division by zero"),
        ("bad.py", "def", "bad.py: SyntaxError: invalid syntax"),
        ("notes.txt", "text", "is not a file of Python; its name must end in .py"),
    ],
)
def test_a_file_that_cannot_be_loaded_is_named(rigidimeter, tmp_path, name, text, words):
    if text is not None:
        (tmp_path / name).write_text(text)
    ran = rigidimeter("--load", tmp_path / name, "estimate", "--help")
    assert ran.status == 1
    assert words in ran.err
