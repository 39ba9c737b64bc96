"""What stands in the documents: fenced blocks and tables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


@dataclass(frozen=True)
class Block:
    """A fenced block: its document, its info string, and its text."""

    path: Path
    info: str
    text: str

    @property
    def where(self) -> str:
        return f"{self.path.relative_to(ROOT)}: {self.text.splitlines()[0] if self.text else ''}"


def blocks(path: Path) -> list[Block]:
    found = re.findall(r"^```([^\n]*)\n(.*?)^```$", path.read_text("utf-8"), re.DOTALL | re.M)
    return [Block(path, info.strip(), text) for info, text in found]


ALL_BLOCKS = [block for path in DOCUMENTS for block in blocks(path)]


def table(path: Path, heading: str) -> dict[str, str]:
    """Return the first two columns of the table under a heading, backticks taken off the first."""
    section = re.split(rf"^#+ {re.escape(heading)}$", path.read_text("utf-8"), flags=re.M)[1]
    section = re.split(r"^#+ ", section, flags=re.M)[0]
    rows = re.findall(r"^\| `([^`]+)` \|([^|]*)\|", section, re.M)
    return {name: text.strip() for name, text in rows}
