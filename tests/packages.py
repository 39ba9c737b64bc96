"""The distributions of this package, and environments to install them into, made by uv."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement
from uv import find_uv_bin

ROOT = Path(__file__).parents[1]
ENVIRONMENT = {name: text for name, text in os.environ.items() if name != "PYTHONPATH"}
LEFT_OUT = shutil.ignore_patterns(
    *(line.strip("/") for line in (ROOT / ".gitignore").read_text("utf-8").split()), ".git"
)
NOT_FOR_USERS = {"all", "bench", "dev", "docs", "gallery"}
"""Extras that hold other extras, or what maintainers need."""


def project() -> dict[str, Any]:
    """Return the table `[project]` of pyproject.toml."""
    return dict(tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"])


def extras() -> dict[str, list[Requirement]]:
    """Return what each extra of users needs; the core has the name `core`."""
    table = project()
    groups = {"core": table["dependencies"], **table["optional-dependencies"]}
    return {
        name: [Requirement(text) for text in texts]
        for name, texts in groups.items()
        if name not in NOT_FOR_USERS
    }


def uv(*words: object) -> None:
    """Run uv; a failure raises with what it wrote."""
    line = [find_uv_bin(), "--quiet", "--no-config", *map(str, words)]
    environment = {**ENVIRONMENT, "UV_PYTHON_DOWNLOADS": "never"}
    ran = subprocess.run(line, env=environment, capture_output=True, text=True)
    if ran.returncode:
        raise RuntimeError(f"uv {' '.join(map(str, words))}\n{ran.stdout}{ran.stderr}")


def built(folder: Path) -> Path:
    """Build the source distribution, and from that the wheel; return the wheel.

    A file of git that the source distribution has not is an error.
    """
    source = folder / "source"  # a build leaves files beside what it builds
    shutil.copytree(ROOT, source, ignore=LEFT_OUT)
    uv("build", "--out-dir", folder / "dist", source)
    (archive,) = (folder / "dist").glob("*.tar.gz")
    with tarfile.open(archive) as opened:
        packed = {name.partition("/")[2] for name in opened.getnames()}
    if missing := _tracked() - packed:
        raise RuntimeError(f"not in {archive.name}; add to MANIFEST.in: {sorted(missing)}")
    (wheel,) = (folder / "dist").glob("*.whl")
    return wheel


def _tracked() -> set[str]:
    # Outside a clone of the repository there are none.
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True)
    return {name for name in listed.stdout.split("\0") if name and name[0] != "."}


def environment(folder: Path, *packages: object, python: object = sys.executable) -> Path:
    """Make an environment with packages and options of `uv pip install`; return its programs.

    One that is there already is replaced.
    """
    uv("venv", "--clear", "--python", python, folder)
    uv("pip", "install", "--python", folder / "bin/python", *packages)
    return folder / "bin"
