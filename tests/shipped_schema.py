"""JSON files against the schemas that the package makes from its types, or ships."""

import json
from functools import cache
from typing import Any

import jsonschema

from belt_sim.results.files import schema


@cache
def validator(name: str) -> jsonschema.Draft202012Validator:
    """The schema of files that name themselves so, itself checked once."""
    jsonschema.Draft202012Validator.check_schema(schema(name))
    return jsonschema.Draft202012Validator(schema(name))


def check(content: dict[str, Any]) -> None:
    """Fail unless ``content`` is JSON and follows the schema that it names."""
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    validator(content["schema"]).validate(content)
    if "discovery" in content:
        check(content["discovery"])
