"""Install and first command with each version of Python and each extra: `python -m tests.matrix`.

The versions are those of the classifiers in pyproject.toml; one that is not on this computer is
named and skipped, but for the oldest, without which the status is 1. Each cell is an environment of
its own with the wheel, an extra and the pinned packages: what the extra names is imported, and a
small recording is estimated. The row `oldest` has everything of
the extra `all` at the lower bounds in pyproject.toml, and with the first Python the golden answers
are compared too. `--oldest` makes that row alone, with that Python, and without these answers.
"""

from __future__ import annotations

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from packaging.requirements import Requirement
from tests.known_joint import angle_rad, torque_nm
from tests.packages import ENVIRONMENT, ROOT, built, environment, extras, project, uv

PINNED = ["--constraint", ROOT / "constraints.txt"]
OLDEST = ["--resolution", "lowest-direct"]
IMPORT_ALL = """
import importlib, re, sys
from importlib.metadata import packages_distributions

plain = lambda name: re.sub("[-_.]+", "-", name).lower()
wanted = set(map(plain, sys.argv[1:]))
for module, distributions in packages_distributions().items():
    if module[0] != "_" and wanted & set(map(plain, distributions)):
        importlib.import_module(module)
"""


def versions() -> list[str]:
    """Return the versions of Python that pyproject.toml names."""
    prefix = "Programming Language :: Python :: "
    return [each.removeprefix(prefix) for each in project()["classifiers"] if prefix in each]


def interpreter(version: str) -> Path | None:
    """Return a Python of this version that starts: this one, or one of pyenv or the search path."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    on_path = shutil.which(f"python{version}")
    found = [Path(sys.executable), *pyenv.glob(f"{version}.*/bin/python"), Path(on_path or "none")]
    line = "import sys; print('%d.%d' % sys.version_info[:2])"
    for python in filter(Path.exists, found):
        ran = subprocess.run([python, "-c", line], capture_output=True, text=True)
        if ran.stdout.strip() == version:
            return python
    return None


def for_users() -> list[Requirement]:
    """Return what the core and the extra `all` need."""
    (own,) = map(Requirement, project()["optional-dependencies"]["all"])
    groups = extras()
    return [each for name in ("core", *sorted(own.extras)) for each in groups[name]]


def write_recording(path: Path) -> None:
    """Write 20 s of a known joint."""
    time_s = np.arange(0.0, 20.0, 0.005)
    columns = np.column_stack([time_s, torque_nm(time_s), angle_rad(time_s)])
    np.savetxt(path, columns, delimiter=",", header="time_s,torque_nm,angle_rad", comments="")


def first_commands(programs: Path, recording: Path, needed: list[Requirement]) -> str:
    """Import the packages and estimate the recording; return what an error ends with, or ''."""
    names = [each.name for each in needed]
    for line in (
        [programs / "python", "-c", IMPORT_ALL, *names],
        [programs / "rigidimeter", "--version"],
        [programs / "rigidimeter", "estimate", recording],
    ):
        # Environments of one version lie at one path, so that each module is compiled once.
        cache = {"PYTHONPYCACHEPREFIX": str(recording.parent / "bytecode")}
        ran = subprocess.run(line, env=ENVIRONMENT | cache, capture_output=True, text=True)
        if ran.returncode:
            return (ran.stderr or ran.stdout).strip().splitlines()[-1]
    return ""


def cell(
    folder: Path, python: Path, recording: Path, needed: list[Requirement], *packages: object
) -> str:
    """Install the packages and run the first commands; return the result."""
    began_s = time.monotonic()
    try:
        error = first_commands(environment(folder, *packages, python=python), recording, needed)
    except RuntimeError as not_installed:
        error = str(not_installed).strip().splitlines()[-1]
    return f"failed: {error}" if error else f"ok, {time.monotonic() - began_s:.0f} s"


def golden(folder: Path) -> str:
    """Compare the golden answers with those that the packages of an environment give."""
    tools = project()["optional-dependencies"]["dev"]
    uv("pip", "install", "--python", folder / "bin/python", *tools)
    line = [
        folder / "bin/python",
        "-m",
        "pytest",
        "-q",
        "-W",
        "ignore::DeprecationWarning",
        "tests/golden",
    ]
    status = subprocess.run(line, cwd=ROOT, env={**ENVIRONMENT, "PYTHONPATH": "src"}).returncode
    return "failed: golden answers" if status else "ok"


def main() -> int:
    """Print the table, row by row; return 1 if a cell failed or there is no oldest Python."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--oldest", action="store_true")
    only_oldest = parser.parse_args().oldest
    wanted = versions()[: 1 if only_oldest else None]
    found = {version: interpreter(version) for version in wanted}
    pythons = {version: python for version, python in found.items() if python}
    for version in found.keys() - pythons.keys():
        print(f"Python {version} is not on this computer: skipped")
    if wanted[0] not in pythons:
        print(f"Python {wanted[0]} is the oldest, and needed")
        return 1
    with tempfile.TemporaryDirectory() as text:
        place = Path(text)
        wheel, recording = built(place), place / "small.csv"
        write_recording(recording)
        rows: dict[str, tuple[list[Requirement], list[object]]] = {}
        if not only_oldest:
            for name, needed in {**extras(), "all": for_users()}.items():
                asked = "" if name == "core" else f"[{name}]"
                rows[name] = needed, [f"rigidimeter{asked} @ {wheel.as_uri()}", *PINNED]
        rows["oldest"] = for_users(), [wheel, *map(str, for_users()), *OLDEST]
        print("\t".join(["extra", *pythons]), flush=True)
        results = []
        for name, (needed, packages) in rows.items():
            row = [
                cell(place / version, python, recording, needed, *packages)
                for version, python in [*pythons.items()][: 1 if name == "oldest" else None]
            ]
            print("\t".join([name, *row]), flush=True)
            results += row
        if not only_oldest:
            results.append(golden(place / next(iter(pythons))))
    return int(any(result.startswith("failed") for result in results))


if __name__ == "__main__":
    sys.exit(main())
