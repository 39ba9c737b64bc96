"""Every package that `make install` brings is pinned, at the version that is tested."""

import re
import tomllib
from collections.abc import Iterable
from importlib.metadata import requires, version
from pathlib import Path

from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]


def pins() -> dict[str, str]:
    lines = (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()
    assert [line for line in lines if not re.fullmatch(r"[\w.-]+==[\w.]+", line)] == []
    return {canonicalize_name(name): pin for name, pin in (line.split("==") for line in lines)}


def required(extras: Iterable[str]) -> set[str]:
    """Return all packages that the extras need, directly or through others, on this machine."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    optional = project["optional-dependencies"]
    done: set[tuple[str, str]] = set()

    def walk(texts: Iterable[str], extra: str) -> None:
        for one in map(Requirement, texts):
            if one.marker is not None and not one.marker.evaluate({"extra": extra}):
                continue
            for wanted in ("", *sorted(one.extras)):
                key = str(canonicalize_name(one.name)), wanted
                if key in done:
                    continue
                done.add(key)
                if key[0] == project["name"]:
                    walk(optional[wanted] if wanted else project["dependencies"], "")
                else:
                    walk(requires(one.name) or (), wanted)

    walk([f"{project['name']}[{','.join(extras)}]"], "")
    return {name for name, _ in done} - {project["name"]}


def test_every_package_installed_for_the_extras_is_pinned_at_its_version() -> None:
    found, pinned = required(["all", "dev"]), pins()
    assert {"numpy", "pytest", "canopen", "mdurl"} <= found  # direct, of an extra, of another's
    assert {name: version(name) for name in found} == {name: pinned.get(name) for name in found}


def test_the_installer_itself_is_pinned() -> None:
    assert "pip" in pins()


def test_packages_come_from_wherever_this_machine_gets_them() -> None:
    """No address is written; that `constraints.txt` has only names and versions, see `pins`."""
    for name in ("Makefile", "constraints.txt", "pyproject.toml"):
        assert "://" not in (ROOT / name).read_text(encoding="utf-8"), name
