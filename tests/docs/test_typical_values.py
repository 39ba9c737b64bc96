"""What the page of typical values calculates is what it says."""

from __future__ import annotations

import re
from math import pi

import pytest
from tests.docs.markdown import ROOT, blocks

PAGE = ROOT / "docs" / "reference" / "typical-values.md"


def test_the_moments_of_inertia_are_those_of_the_segments(capsys: pytest.CaptureFixture) -> None:
    (block,) = [one for one in blocks(PAGE) if one.info == "python"]
    exec(compile(block.text, block.where, "exec"), {})
    assert capsys.readouterr().out.strip() == block.text.rsplit("# ", 1)[1].strip()


@pytest.mark.parametrize(
    ("joint", "inertia_kg_m2", "resonances_hz"),
    [
        ("human elbow, moving", 0.076, (0.8, 3.0)),
        ("human wrist, relaxed", 0.0034, (2.0,)),
        ("human ankle, tonic contraction", 0.015, (3.0, 8.0)),
    ],
)
def test_the_stiffness_of_a_resonance(
    joint: str, inertia_kg_m2: float, resonances_hz: tuple[float, ...]
) -> None:
    text = PAGE.read_text("utf-8")
    (row,) = [line for line in text.splitlines() if joint in line and "resonance" in line]
    stated = re.findall(r"[\d.]+", row.split("|")[4])
    found = [inertia_kg_m2 * (2 * pi * hz) ** 2 for hz in resonances_hz]
    assert [f"{value:.1f}" if value < 1 else f"{value:.0f}" for value in found] == stated
