"""Blocks of documents that the code writes are as it would write them now."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from tests.docs.files_tables import analysis
from tests.docs.generated import BLOCKS, FOLDER, with_blocks
from tests.docs.json_schemas import SCHEMAS, schema_text

from rigidimeter.analysis.reading import estimates_document


@pytest.mark.parametrize("page", BLOCKS, ids=lambda page: page.name)
def test_a_block_is_as_the_code_has_it(page: Path) -> None:
    made = "python -m tests.docs.generated writes it anew"
    assert page.read_text("utf-8") == with_blocks(page), made


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_is_as_the_code_has_it(name: str) -> None:
    text = (FOLDER / name).read_text("utf-8")
    assert text == schema_text(name), "python -m tests.docs.generated writes it anew"
    Draft202012Validator.check_schema(json.loads(text))


def test_a_document_is_valid_and_one_with_a_text_for_a_number_is_not() -> None:
    schema = Draft202012Validator(json.loads((FOLDER / "estimates.json").read_text("utf-8")))
    document = json.loads(json.dumps(estimates_document(analysis())))
    assert schema.is_valid(document)
    document["epochs"][0]["stiffness_nm_rad"] = "1.8"
    assert not schema.is_valid(document)
