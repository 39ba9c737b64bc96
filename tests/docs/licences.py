"""The licences of all packages that users may install: `python -m tests.docs.licences`.

It installs the pinned packages of the core and of each extra for users into an environment, reads
what their metadata say of their licences, and writes the tables of docs/reference/licences.md.
"""

from __future__ import annotations

import json
import re
import subprocess
import tempfile
from pathlib import Path

from tests.packages import ENVIRONMENT, ROOT, environment, extras

PAGE = ROOT / "docs" / "reference" / "licences.md"
BEGIN, END = "<!-- licences: begin -->\n", "<!-- licences: end -->"
COPYLEFT = re.compile(r"\b(?:A|L)?GPL|\bMPL|\bEPL|Lesser|General Public|Mozilla")
READ = """
import json
from importlib.metadata import distributions

def licence(one):
    about = one.metadata
    if text := about.get("License-Expression"):
        return text
    ours = [c for c in about.get_all("Classifier") or () if c.startswith("License :: OSI")]
    if ours:
        return ", ".join(c.rpartition(" :: ")[2] for c in ours)
    files = [f for f in one.files or () if "licen" in f.name.lower() and "dist-info" in str(f)]
    text = "".join([about.get("License") or "", *(f.read_text() for f in files)])
    if "Permission is hereby granted, free of charge" in text:
        return "MIT"
    if "Redistribution and use in source and binary forms" in text:
        return "BSD"
    return text.split("\\n")[0].strip() or "not stated"

print(json.dumps([[d.metadata["Name"], d.version, licence(d)] for d in distributions()]))
"""


def plain(name: str) -> str:
    """Return the name of a package as every spelling of it is compared."""
    return re.sub(r"[-_.]+", "-", name).lower()


def needed_by() -> dict[str, list[str]]:
    """Return by package in which extras it stands; `core` is no extra."""
    found: dict[str, list[str]] = {}
    for extra, packages in extras().items():
        for each in packages:
            found.setdefault(plain(each.name), []).append(extra)
    return found


def installed() -> list[tuple[str, str, str]]:
    """Return name, version and licence of every package of the core and of the extras."""
    packages = [str(each) for every in extras().values() for each in every]
    with tempfile.TemporaryDirectory() as place:
        pinned = ["--constraint", ROOT / "constraints.txt"]
        programs = environment(Path(place) / "all", *packages, *pinned)
        read = subprocess.run(
            [programs / "python", "-c", READ], check=True, env=ENVIRONMENT, capture_output=True
        )
    return sorted((tuple(row) for row in json.loads(read.stdout)), key=lambda row: row[0].lower())


def tables(rows: list[tuple[str, str, str]]) -> str:
    """Return the table of the packages that pyproject.toml names, and that of theirs."""
    direct = needed_by()
    lines = ["| package | version | licence | needed by |", "| --- | --- | --- | --- |"]
    for name, version, licence in rows:
        if extras_of := direct.get(plain(name)):
            shown = f"**{licence}** (copyleft)" if COPYLEFT.search(licence) else licence
            lines.append(f"| {name} | {version} | {shown} | {', '.join(extras_of)} |")
    lines += ["", "These need, in turn:", ""]
    lines += ["| package | version | licence |", "| --- | --- | --- |"]
    for name, version, licence in rows:
        if plain(name) not in direct:
            shown = f"**{licence}** (copyleft)" if COPYLEFT.search(licence) else licence
            lines.append(f"| {name} | {version} | {shown} |")
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    before, _, rest = PAGE.read_text("utf-8").partition(BEGIN)
    PAGE.write_text(before + BEGIN + tables(installed()) + END + rest.partition(END)[2], "utf-8")
