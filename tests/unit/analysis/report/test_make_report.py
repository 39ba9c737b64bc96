"""`report` takes a result, estimates, a recording or its path, and gives one page."""

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from rigidimeter.analysis.reading import read
from rigidimeter.analysis.report import Shown, report
from rigidimeter.analysis.study import compare
from rigidimeter.core.errors import UserError
from rigidimeter.core.records import Epoch


@pytest.fixture(scope="module")
def csv_file(epochs: list[Epoch], tmp_path_factory: pytest.TempPathFactory) -> Path:
    channels = epochs[1].channels
    names = ("torque_nm", "angle_rad", "velocity_rad_s", "perturbation_nm")
    columns = [channels["torque_nm"].time_s, *(channels[name].values for name in names)]
    path = tmp_path_factory.mktemp("recorded") / "elbow.csv"
    header = ",".join(("time_s", *names))
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
    return path


def test_estimates_give_a_page_without_figures_of_signals(study: Shown, tmp_path: Path) -> None:
    page = report(study.analysis, tmp_path, "Estimates alone")
    text = page.read_text(encoding="utf-8")
    assert "<h1>Estimates alone</h1>" in text
    assert "DBS − OFF: each epoch counted" in text
    assert (tmp_path / "figures" / "distribution_stiffness_nm_rad.svg").exists()
    assert not list((tmp_path / "figures").glob("torque_*"))


@pytest.mark.usefixtures("no_figures")
def test_a_path_and_what_is_read_from_it_give_the_same_page(csv_file: Path, tmp_path: Path) -> None:
    one = report(csv_file, tmp_path / "path")
    two = report(read(csv_file), tmp_path / "recording")
    assert "<h1>Joint rigidity</h1>" in one.read_text(encoding="utf-8")
    assert str(csv_file) in one.read_text(encoding="utf-8")
    for table in ("estimates", "pooled", "provenance"):
        a, b = (
            (page.parent / "tables" / f"{table}.csv").read_text().splitlines()
            for page in (one, two)
        )
        # Only the time of the analysis may differ.
        assert [x for x in a if "made (UTC)" not in x] == [x for x in b if "made (UTC)" not in x]


@pytest.mark.usefixtures("no_figures")
def test_the_recordings_of_a_compared_study_are_read_again(
    scored_study: Path, tmp_path: Path
) -> None:
    folder = Path(shutil.copytree(scored_study, tmp_path / "study"))
    result = compare(folder, resamples=0)
    page = report(result, tmp_path / "report")
    assert (page.parent / "figures" / "loops.svg").exists()
    assert "<h1>Small study</h1>" in page.read_text(encoding="utf-8")
    with (folder / "sessions.csv").open("a") as file:
        file.write("# seen again\n")
    with pytest.raises(UserError, match=r"sessions\.csv has changed since the study was compared"):
        report(result, tmp_path / "report")


def test_a_folder_that_cannot_be_written_says_so(study: Shown, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="the report cannot be written"):
        report(study.analysis, tmp_path / "file")


def test_what_cannot_be_reported_is_refused(tmp_path: Path) -> None:
    table: Any = pd.DataFrame({"damping": [1.0]})
    with pytest.raises(UserError, match="report takes what compare, estimate or read returned"):
        report(table, tmp_path / "out")


def test_a_column_may_have_a_slash_in_its_name(tmp_path: Path) -> None:
    table = pd.DataFrame({"K N·m/rad": [1.0, 2.0, 3.0, 5.0, 6.0, 7.0], "condition": [*"AAABBB"]})
    result = compare(table, value="K N·m/rad", resamples=0)
    report(result, tmp_path)
    assert (tmp_path / "figures" / "distribution_K N·m_rad.svg").is_file()
