"""JSON files against the schemas that the package ships."""

import json
from functools import cache
from importlib.resources import files
from typing import Any

import jsonschema


@cache
def validator(name: str) -> jsonschema.Draft202012Validator:
    """The shipped schema of a name, itself checked once."""
    schema = json.loads((files("belt_sim") / "schemas" / f"{name}.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def check(content: dict[str, Any]) -> None:
    """Fail unless ``content`` is JSON and follows the schema that it names."""
    shipped = validator(content["schema"].split("-")[1].split("/")[0])
    assert shipped.schema["properties"]["schema"]["const"] == content["schema"]
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    shipped.validate(content)
    if "discovery" in content:
        check(content["discovery"])
