"""The data of `rm.data`: whole, labelled as virtual, small, and what their generator makes."""

import doctest
import fnmatch
import tomllib
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from tests import example_data as generator
from tests.replayed import assert_folder_replayed

import rigidimeter as rm
from rigidimeter.analysis.reading import example_data
from rigidimeter.analysis.study import load_study
from rigidimeter.core.errors import UserError
from rigidimeter.virtual import plan_study, run_virtual_session

RECORDINGS = [name for name in rm.data() if name != "study"]
RESOLUTION = {"torque_nm": 5e-4, "angle_rad": 4e-6}
"""Of the sensors: a library that rounds otherwise may move a sample by one step."""


def test_without_a_name_it_lists_one_line_each() -> None:
    lines = repr(rm.data()).splitlines()
    assert [line.split()[0] for line in lines] == [*rm.data()]
    assert rm.data()._repr_html_().count("<tr>") == len(lines)


@pytest.mark.parametrize("name", RECORDINGS)
def test_a_recording_is_read_without_a_remark_and_is_virtual(name: str) -> None:
    recording = rm.data(name)
    assert recording.notices == ()
    assert len(recording.epochs) >= 3
    assert all(epoch.virtual for epoch in recording.epochs)
    assert {epoch.task for epoch in recording.epochs} == {
        "sinusoid" if name == "sinusoids" else "prbs"
    }


def test_the_study_is_a_folder_of_virtual_recordings_on_eight_days() -> None:
    found = load_study(rm.data("study"))
    assert all(epoch.virtual for epoch in found.epochs)
    sessions = (rm.data("study") / "sessions.csv").read_text("utf-8").splitlines()[1:]
    assert len({line.split(",")[2] for line in sessions}) == 8
    assert len(found.epochs) == 4 * len(sessions) == 64


def test_estimates_hold_what_was_simulated() -> None:
    for fit in rm.estimate(rm.data("elbow")).pooled[:2]:
        truth = {"inertia_kg_m2": 0.0045, **generator.JOINTS[fit.condition]}
        for name, true in truth.items():
            assert getattr(fit, f"{name}_low") < true < getattr(fit, f"{name}_high")


def test_an_unknown_name_is_answered_with_those_that_exist() -> None:
    with pytest.raises(UserError, match=r"there are elbow, .*, study; did you mean elbow\?"):
        rm.data("elbw")
    with pytest.raises(UserError, match="no example data are named 3: there are elbow"):
        rm.data(3)  # type: ignore[call-overload]


def test_the_examples_of_the_docstring_hold() -> None:
    found = doctest.testmod(example_data)
    assert found.attempted
    assert found.failed == 0


def test_all_files_are_in_the_wheel_and_small() -> None:
    root = Path(generator.__file__).parents[1]
    patterns = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))
    patterns = patterns["tool"]["setuptools"]["package-data"]["rigidimeter"]
    files = [path for path in example_data.FOLDER.rglob("*") if path.is_file()]
    names = [path.relative_to(root / "src" / "rigidimeter").as_posix() for path in files]
    assert [n for n in names if not any(fnmatch.fnmatch(n, one) for one in patterns)] == []
    assert sum(path.stat().st_size for path in files) <= 2e6


def test_recordings_are_what_the_generator_makes(tmp_path: Path) -> None:
    """One from each rig; `make example-data` makes all."""
    plan = plan_study(generator.study_design(), generator.SEED)[0]
    session = tmp_path / Path(plan.folder).name
    run_virtual_session(plan.settings, session)
    assert_folder_replayed(session)
    made = {
        "reflex.parquet": generator.recording("reflex"),
        f"study/{session.name}.parquet": generator.day(session),
    }
    for name, table in made.items():
        stored = pyarrow.parquet.read_table(example_data.FOLDER / name)
        assert stored.schema.equals(table.schema, check_metadata=True)
        for column in table.column_names:
            if column in generator.UNITS:
                step = RESOLUTION.get(column, 1e-5)
                np.testing.assert_allclose(stored[column], table[column], rtol=0, atol=1.01 * step)
            else:
                assert stored[column].to_pylist() == table[column].to_pylist()
