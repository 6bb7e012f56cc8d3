"""JSON files against the schemas that the package ships."""

import json
from importlib.resources import files
from typing import Any

import jsonschema


def check(content: dict[str, Any]) -> None:
    """Fail unless ``content`` is JSON and follows the schema that it names."""
    name = content["schema"].split("-")[1].split("/")[0]
    schema = json.loads((files("belt_sim") / "schemas" / f"{name}.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(schema)
    assert schema["properties"]["schema"]["const"] == content["schema"]
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    jsonschema.validate(content, schema, cls=jsonschema.Draft202012Validator)
    if "discovery" in content:
        check(content["discovery"])
