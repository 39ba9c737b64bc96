"""The functions of `import rigidimeter`: listed, typed, and imported only when they are used."""

import subprocess
import sys

import pytest

import rigidimeter

NAMES = {"compare", "design", "estimate", "identify", "read", "report", "simulate"}


def test_the_front_door_lists_what_users_need() -> None:
    assert set(rigidimeter.__all__) == NAMES | {"__version__"}
    assert set(dir(rigidimeter)) >= NAMES


def test_each_name_is_a_function_with_a_docstring() -> None:
    for name in NAMES:
        function = getattr(rigidimeter, name)
        assert callable(function)
        assert len((function.__doc__ or "").splitlines()) > 3
        assert getattr(rigidimeter, name) is function


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
    assert ours == {"rigidimeter", "rigidimeter.version"}


def test_the_names_stay_functions_when_their_rooms_are_imported() -> None:
    """A sub-package of the same name would take the place of the function."""
    code = (
        "import rigidimeter, rigidimeter.experiment, rigidimeter.reporting, rigidimeter.study;"
        f"print(all(callable(getattr(rigidimeter, name)) for name in {sorted(NAMES)}))"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout == "True\n"
