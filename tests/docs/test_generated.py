"""Blocks of documents that the code writes are as it would write them now."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.docs.generated import BLOCKS, with_blocks


@pytest.mark.parametrize("page", BLOCKS, ids=lambda page: page.name)
def test_a_block_is_as_the_code_has_it(page: Path) -> None:
    made = "python -m tests.docs.generated writes it anew"
    assert page.read_text("utf-8") == with_blocks(page), made
