"""The tests of the guard, and of how a driver stops, see what is put wrong there."""

import subprocess
import sys
from pathlib import Path

import pytest
from tests.mutation.equivalent import EQUIVALENT
from tests.mutation.mutants import modules, mutants

ROOT = Path(__file__).parents[2]


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


def test_every_mutant_can_be_compiled_and_differs():
    for path in modules():
        same = compile(path.read_text(encoding="utf-8"), "m", "exec")
        names = set()
        for mutant in mutants(path):
            assert compile(mutant.source, "m", "exec") != same
            names.add(mutant.name)
        assert len(names) > (50 if path.parent.name == "guard" else 5)


def test_what_is_known_to_do_the_same_is_there_and_has_a_reason():
    there = {mutant.name for path in modules() for mutant in mutants(path)}
    assert set(EQUIVALENT) <= there
    assert all(EQUIVALENT.values())


def test_a_sample_of_the_faults_is_seen():
    ran = run("--every", "80")
    assert ran.returncode == 0, ran.stdout + ran.stderr


@pytest.mark.slow
def test_every_fault_is_seen():
    ran = run()
    assert ran.returncode == 0, ran.stdout + ran.stderr
