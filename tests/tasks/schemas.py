"""Every summary that a test writes is held against the schema that docs give for its verb."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from jsonschema import Draft202012Validator

SCHEMAS = Path(__file__).parents[2] / "docs" / "schemas"


@cache
def validator(task: str) -> Draft202012Validator:
    schema = json.loads((SCHEMAS / f"{task}.json").read_text(encoding="utf-8"))
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


def validated(file: Path) -> dict[str, Any]:
    """The content of a summary.json. Fails where it is not what its schema says."""
    content: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
    wrong = [f"{e.json_path}: {e.message[:200]}" for e in validator(content["task"]).iter_errors(content)]
    assert not wrong, f"{file}: {'; '.join(wrong)}"
    return content
