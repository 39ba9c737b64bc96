"""The tests of what moves the arm see what is put wrong in it."""

import subprocess
import sys
from pathlib import Path

import pytest
from tests.mutation.equivalent import EQUIVALENT
from tests.mutation.hand_made import HAND_MADE
from tests.mutation.mutants import PACKAGE, mutants
from tests.mutation.runner import BY_HAND, TESTS, UNIT

ROOT = Path(__file__).parents[2]
MODULES = [PACKAGE / name for name in TESTS]


def run(*arguments):
    command = [sys.executable, "-m", "tests.mutation", *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def test_each_fault_has_a_name_of_its_own(tmp_path):
    module = tmp_path / "module.py"
    module.write_text("def f(a, b):\n    return a < b\n\n\ndef g(a, b):\n    return a < b\n")
    assert [mutant.name for mutant in mutants(module)] == [
        *("module.py f: return a < b → return None", "module.py f: a < b → a <= b"),
        *("module.py f: a < b → a >= b", "module.py g: return a < b → return None"),
        *("module.py g: a < b → a <= b", "module.py g: a < b → a >= b"),
    ]


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.stem)
def test_mutants_can_be_compiled_and_differ(path):
    names = []

    def sampled(name):
        names.append(name)
        return len(names) % 40 == 1

    same = compile(path.read_text(encoding="utf-8"), "m", "exec")
    for mutant in mutants(path, sampled):
        assert compile(mutant.source, "m", "exec") != same
    assert names
    assert len(set(names)) == len(names)


def test_every_module_of_guard_and_control_is_looked_at():
    there = {
        path.relative_to(PACKAGE).as_posix()
        for path in (PACKAGE / "rig" / "guard").glob("*.py")
        if path.name != "__init__.py"
    }
    assert there
    assert there | {"model/controller.py"} <= set(TESTS)
    tests = {test for found in (TESTS, BY_HAND) for of_one in found.values() for test in of_one}
    assert all((ROOT / UNIT / test).exists() for test in tests)


def test_what_is_known_to_do_the_same_is_there_and_has_a_reason():
    known = EQUIVALENT.keys()
    there = {
        mutant.name for path in MODULES for mutant in mutants(path, lambda name: name in known)
    }
    assert there == known
    assert all(EQUIVALENT.values())


@pytest.mark.parametrize("fault", HAND_MADE, ids=lambda fault: fault.file)
def test_what_is_made_by_hand_stands_once_in_the_source_and_changes_it(fault):
    source = (PACKAGE / fault.file).read_text(encoding="utf-8")
    assert source.count(fault.text) == 1, fault
    assert compile(fault.mutant().source, "m", "exec") != compile(source, "m", "exec")
    assert fault.effect
    assert fault.file in TESTS or fault.file in BY_HAND


@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(["--every", "160", "step.py"], marks=pytest.mark.slow),
        ["--hand-made", "--every", "40"],
    ],
)
def test_a_sample_of_the_faults_is_seen(arguments):
    ran = run(*arguments)
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [[], ["--hand-made"]])
def test_every_fault_is_seen(arguments):
    ran = run(*arguments)
    assert ran.returncode == 0, ran.stdout + ran.stderr
