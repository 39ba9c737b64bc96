"""Which files the page offers as protocols."""

import pytest

from rigidimeter.core.errors import UserError
from rigidimeter.rig.console.page import protocol_names, read_protocol


@pytest.fixture
def folder(tmp_path):
    there = tmp_path / "protocols"
    there.mkdir()
    (there / "long.toml").write_text("prbs.duration_s = 40.0\n")
    (there / "wrong.toml").write_text("prbs.duration_s = -1\n")
    (there / "damaged.toml").write_text("[prbs\n")
    (there / "rig.toml").write_text('[drive]\ndriver = "ascii"\n')
    (there / "study.toml").write_text("")
    (tmp_path / "outside.toml").write_text("prbs.duration_s = 30.0\n")
    (there / "linked.toml").symlink_to(tmp_path / "outside.toml")
    return there


def test_rig_files_study_files_and_links_outside_are_no_protocols(folder):
    assert protocol_names(folder) == ["damaged.toml", "long.toml", "wrong.toml"]
    assert read_protocol(folder, "long.toml").prbs.duration_s == 40.0


@pytest.mark.parametrize("name", ["../outside.toml", "linked.toml", "/etc/passwd", "rig.toml", ""])
def test_what_is_not_in_the_folder_is_refused(folder, name):
    with pytest.raises(UserError, match=r"is no protocol file of .*; there are: damaged.toml"):
        read_protocol(folder, name)


@pytest.mark.parametrize(("name", "words"), [("wrong.toml", "duration_s"), ("damaged.toml", ":")])
def test_a_wrong_file_gets_its_sentence(folder, name, words):
    with pytest.raises(UserError, match=name) as refused:
        read_protocol(folder, name)
    assert words in str(refused.value)
