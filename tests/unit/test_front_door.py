"""The functions of `import rigidimeter`: listed, typed, and imported only when they are used."""

import doctest
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pytest

import rigidimeter
from rigidimeter.core.errors import UserError, arguments_named
from rigidimeter.core.findings import KINDS, Finding, explained

NAMES = {
    *("batch", "compare", "data", "design", "estimate", "fit_terms", "identify"),
    *("plot", "read", "report", "simulate"),
}


def test_the_front_door_lists_what_users_need() -> None:
    assert set(rigidimeter.__all__) == NAMES | {"__version__"}
    assert set(dir(rigidimeter)) >= NAMES


def test_each_name_is_a_function_with_a_docstring() -> None:
    for name in NAMES:
        function = getattr(rigidimeter, name)
        assert callable(function)
        assert len((function.__doc__ or "").splitlines()) > 3
        assert getattr(rigidimeter, name) is function


@pytest.mark.parametrize("name", sorted(NAMES))
def test_its_examples_run(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (found,) = doctest.DocTestFinder(recurse=False).find(getattr(rigidimeter, name), name)
    assert found.examples, "the docstring has no example"
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS)
    runner.run(found)
    plt.close("all")
    assert not runner.failures, capsys.readouterr().out


def test_messages_name_arguments_and_not_options(tmp_path) -> None:
    bad, good = tmp_path / "bad.csv", tmp_path / "good.csv"
    rows = "".join(f"{k / 100},{k % 7},{k % 5 / 100}\n" for k in range(4000))
    bad.write_text("x,torque_nm,angle_rad\n" + rows)
    good.write_text("time_s,torque_nm,angle_rad\n" + rows)
    wanted = r"say rate_hz, or .* as in column={'time': 'NAME'} "
    with pytest.raises(UserError, match=wanted) as raised:
        rigidimeter.read(bad)
    assert "--" not in str(raised.value)
    (notice,) = rigidimeter.read([bad, good]).notices
    assert "say rate_hz" in notice.text
    assert "--" not in notice.text


def test_arguments_in_place_of_options() -> None:
    for message, expected in {
        "say --rate-hz": "say rate_hz",
        "a sensor that needs --reaction": "a sensor that needs reaction=True",
        "give --column 'torque_nm=My Fz'; or not": "give column={'torque_nm': 'My Fz'}; or not",
        "Use --method iv with it": "Use method='iv' with it",
        "Include it: rigidimeter model --terms inertia,reflex+.": (
            "Include it: rigidimeter.fit_terms(recording, 'inertia,reflex+')."
        ),
        "try `rigidimeter model --compare`.": "try rigidimeter.fit_terms(recording, compare=True).",
        "per radian: --controller 0.05 1.6.": (
            "per radian: settings={'controller': {'inertia_kg_m2': 0.05, 'damping_nm_s_rad': 1.6}}."
        ),
        "Report both; --keep-active fits everything.": (
            "Report both; settings={'estimation': {'leave_out_active': False}} fits everything."
        ),
        "by itself: --group NAME, or group= in Python.": "by itself: group='NAME'.",
        "a processor of its own with `--cpu N`": "a processor of its own with `--cpu N`",
        "names no option -- only a dash--like file": "names no option -- only a dash--like file",
    }.items():
        assert arguments_named(message) == expected


def test_remedies_of_findings_name_arguments() -> None:
    for kind in KINDS.values():
        for _, words in explained(kind):
            remedy = arguments_named(words.remedy)
            assert "--" not in remedy.replace("`--cpu N`", "")
            assert "rigidimeter model" not in remedy
    found = Finding("band_sensitivity", "caution", 6.0)
    assert found.remedy == arguments_named(found.words.remedy)
    slow = Finding("slow", "note", 1.0, facts={"text": "A", "remedy": "Use --method iv."})
    assert (slow.remedy, slow.words.remedy) == ("Use method='iv'.", "Use --method iv.")


def test_another_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'fit'"):
        _ = rigidimeter.fit


def test_importing_the_package_imports_nothing_heavy() -> None:
    code = "import rigidimeter, sys; dir(rigidimeter); print(' '.join(sys.modules))"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    assert not {"numpy", "scipy", "pandas", "matplotlib", "pyarrow", "pydantic"} & set(loaded)
    ours = {name for name in loaded if name.startswith("rigidimeter")}
    assert ours == {"rigidimeter", "rigidimeter.core", "rigidimeter.core.version"}


def test_estimate_imports_no_part_of_scipy() -> None:
    """Each is imported when it is used: together they cost more than the rest."""
    code = "import rigidimeter, sys; rigidimeter.estimate; print(' '.join(sys.modules))"
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    parts = {f"scipy.{name}" for name in ("fft", "optimize", "signal", "special", "stats")}
    assert not {"pandas", "matplotlib", "h5py", *parts} & set(ran.stdout.split())


def test_the_names_stay_functions_when_their_rooms_are_imported() -> None:
    """A sub-package of the same name would take the place of the function."""
    code = (
        "import rigidimeter, rigidimeter.analysis.batch, rigidimeter.planning;"
        "import rigidimeter.analysis.report, rigidimeter.analysis.study;"
        f"print(all(callable(getattr(rigidimeter, name)) for name in {sorted(NAMES)}))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "True\n"
