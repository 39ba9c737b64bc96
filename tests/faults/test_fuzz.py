"""A part of the cases of the fuzzer, in one process: no traceback, only the output is changed."""

import pytest
from tests import fuzz
from tests.fuzz import run_apart, run_case, run_here, warm
from tests.fuzz_inputs import TARGETS

SHARES = 5


@pytest.mark.parametrize("share", range(SHARES))
def test_damaged_inputs_are_read_or_refused(share):
    failed = [
        f"{result.case}\n{result.failed}"
        for result in (run_case(case, 1) for case in range(share, 200, SHARES))
        if result.failed
    ]
    assert failed == []


@pytest.mark.parametrize(
    ("name", "sound", "damaged"),
    [(".tdms file", b"\x0f\0\0\0wf_start_off", b"\xff\xff\xff\xffwf_start_off"),
     ("Feather", b"ARROW1\0\0", b"ARRO\x98\0\0\0")],
)  # fmt: skip
def test_lengths_that_are_stated_take_no_memory(name, sound, damaged, monkeypatch):
    """A name of 4 GB in a TDMS file, a first message of 1.3 GB in an Arrow stream."""
    target = next(target for target in TARGETS if target.name == name)

    def prepare(case, seed, folder):
        target.make(folder)
        path = folder / target.damaged
        whole = path.read_bytes()
        assert sound in whole
        path.write_bytes(whole.replace(sound, damaged, 1))
        return name, [*target.command]

    monkeypatch.setattr(fuzz, "prepare", prepare)
    ((_, result),) = run_apart([0], 5)
    assert result.failed == ""
    assert result.refused


@pytest.mark.slow
def test_two_thousand_damaged_inputs_each_in_a_process_of_its_own():
    """30 s and 1 GB each; `python -m tests.fuzz` runs more."""
    warm()
    found = [result for _, result in run_apart(range(2000), 5)]
    assert [f"{one.case}\n{one.failed}" for one in found if one.failed] == []


@pytest.mark.parametrize("target", TARGETS, ids=lambda target: target.name)
def test_sound_inputs_are_read(target, tmp_path, monkeypatch):
    target.make(tmp_path)
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path)
    _, said = run_here(target.command)
    for word in ("cannot be read", "is not a ", "is damaged", "is missing", "no such", "Usage"):
        assert word not in said
