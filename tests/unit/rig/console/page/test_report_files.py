"""Which files the server gives away as a report."""

import pytest

from rigidimeter.rig.console.page import report_file, report_folder, report_link


@pytest.fixture
def root(tmp_path):
    for name in ("report", "S01-1-report", "S01-1", "empty-report"):
        (tmp_path / "root" / name / "tables").mkdir(parents=True)
    for name in ("report", "S01-1-report", "S01-1"):
        (tmp_path / "root" / name / "report.html").write_text("page")
        (tmp_path / "root" / name / "tables" / "a.csv").write_text("a")
    (tmp_path / "root" / "key.csv").write_text("code,condition")
    (tmp_path / "root" / "empty-report" / "a.txt").write_text("a")
    (tmp_path / "outside").mkdir()
    (tmp_path / "outside" / "report.html").write_text("page")
    (tmp_path / "root" / "link-report").symlink_to(tmp_path / "outside")
    (tmp_path / "root" / "report" / "link.csv").symlink_to(tmp_path / "root" / "key.csv")
    return tmp_path / "root"


@pytest.mark.parametrize("folder", [report_folder(), report_folder("S01-1")])
def test_a_report_and_its_tables_are_served(root, folder):
    assert report_file(root, folder, "report.html") == root / folder / "report.html"
    assert report_file(root, folder, "tables/a.csv") == root / folder / "tables" / "a.csv"
    assert report_link(folder) == f"/report/{folder}/report.html"


@pytest.mark.parametrize(
    ("folder", "path"),
    [
        ("S01-1", "report.html"),
        ("report", "../key.csv"),
        ("report", "/etc/passwd"),
        ("report", "link.csv"),
        ("report", "tables"),
        ("report", "none.csv"),
        ("empty-report", "a.txt"),
        ("link-report", "report.html"),
        ("../outside/x-report", "report.html"),
        ("..", "report.html"),
    ],
)
def test_nothing_else_is(root, folder, path):
    assert report_file(root, folder, path) is None
