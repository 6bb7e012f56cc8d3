"""YAML as plain text values that remember their lines, and what pydantic finds wrong with them."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, get_args

import yaml
from pydantic import BaseModel

from belt_sim.campaign.problems import Problem, did_you_mean
from belt_sim.errors import InputError
from belt_sim.files import CarefulLoader

#: Largest campaign.yaml that is parsed [characters]; a sheet of a hundred signals has a tenth of it.
LONGEST = 200_000

Path = tuple[str, ...]


@dataclass(frozen=True)
class MarkedYaml:
    """tree: nested dicts and lists with text (or None) leaves; lines: path -> line number from 1."""

    tree: object
    lines: dict[Path, int] = field(default_factory=dict)

    def line(self, path: Path) -> int | None:
        """Line of the nearest known part of ``path``."""
        for n in range(len(path), -1, -1):
            if path[:n] in self.lines:
                return self.lines[path[:n]]
        return None


def parse(text: str, file: str, problems: list[Problem]) -> MarkedYaml | None:
    """Parse; syntax errors, repeated keys and aliases go to ``problems``. None when nothing can be read."""
    if len(text) > LONGEST:
        remedy = f"must be at most {LONGEST} characters; is this the campaign sheet?"
        problems.append(Problem(file=file, name="length", value=len(text), unit="characters", remedy=remedy))
        return None
    try:
        root = yaml.compose(text, Loader=CarefulLoader)
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        problems.append(_syntax_problem(error, text, file))
        return None
    if root is None:
        problems.append(Problem(file=file, remedy="the file is empty; state schema, title, machine, belt"))
        return None
    return _walk(root, file, problems)


def _syntax_problem(error: Exception, text: str, file: str) -> Problem:
    """Return what the YAML library refuses, with its line where that is known."""
    if isinstance(error, yaml.MarkedYAMLError):
        mark = error.problem_mark or error.context_mark
        cause = " ".join(str(error.problem or error.context).split())
        return Problem(
            file=file, line=mark.line + 1 if mark else None, remedy=f"not valid YAML ({cause}); mend this line"
        )
    if isinstance(error, yaml.reader.ReaderError):
        line = text[: error.position].count("\n") + 1
        return Problem(file=file, line=line, value=chr(error.character), remedy="remove this character")
    return Problem(file=file, remedy=f"not valid YAML ({type(error).__name__}); compare with a sample campaign")


def _walk(root: yaml.Node, file: str, problems: list[Problem]) -> MarkedYaml:
    """The values under a node, with their lines."""
    lines: dict[Path, int] = {}
    seen: set[int] = set()

    def refuse(line: int, path: Path, remedy: str) -> None:
        problems.append(Problem(file=file, line=line, name=".".join(path), remedy=remedy))

    def plain(node: yaml.Node, path: Path) -> object:
        line = node.start_mark.line + 1
        lines.setdefault(path, line)
        if id(node) in seen:
            refuse(line, path, "write the value out; anchors and aliases are not read here")
            return None
        seen.add(id(node))
        if isinstance(node, yaml.SequenceNode):
            return [plain(item, (*path, str(i))) for i, item in enumerate(node.value)]
        if not isinstance(node, yaml.MappingNode):
            return None if node.tag == "tag:yaml.org,2002:null" else node.value
        out: dict[str, object] = {}
        for key, value in node.value:
            line = key.start_mark.line + 1
            inner = (*path, str(key.value))
            if not isinstance(key, yaml.ScalarNode):
                refuse(line, path, "a key must be one word")
            elif key.value in out:
                refuse(line, inner, f"stated twice, first in line {lines[inner]}; keep one")
            else:
                lines[inner] = line
                out[key.value] = plain(value, inner)
        return out

    return MarkedYaml(plain(root, ()), lines)


#: pydantic's type of error -> what to do about it.
REMEDIES = {
    "missing": "is missing; state it",
    "float_parsing": "must be a number, with a decimal point",
    "float_type": "must be a number, with a decimal point",
    "finite_number": "must be a finite number",
    "string_type": "must be text",
    "model_type": "must be a mapping, like {value: 200, unit: mm}",
    "dict_type": "must be a mapping, like {y1: {unit: mm, at: point_1, white: 0.02}}",
}


def validation_problem(
    details: Any,
    path: Path,
    marked: MarkedYaml,
    file: str,
    schema: type[BaseModel],
    *,
    examples: Mapping[str, str] | None = None,
    remedies: Mapping[str, str] = REMEDIES,
) -> Problem:
    """Translate one pydantic error into a problem at its line.

    path: of the value in the file; schema: of the whole file; examples: how a required key is written.
    """
    kind, value = details["type"], details["input"]
    value = None if isinstance(value, dict | list | BaseModel) else value
    unit, inner = "", path
    error = details.get("ctx", {}).get("error")
    if isinstance(error, InputError):
        inner = path if not error.name or path[-1:] == (error.name,) else (*path, *error.name.split("."))
        value, unit, remedy = error.value, error.unit, error.remedy
    elif kind == "missing" and examples is not None:
        example = examples.get(".".join(path[-2:])) or examples.get(path[-1], f"{path[-1]}: ...")
        value, remedy = None, f"is missing; state it, for example {example}"
    elif kind == "extra_forbidden":
        value, remedy = None, f"unknown key; {did_you_mean(path[-1], _known_keys(schema, path[:-1]))}"
    elif kind == "literal_error":
        remedy = f"must be {details['ctx']['expected']}"
    elif value is None and kind in remedies:
        remedy = "is blank or no single value; " + remedies[kind]
    else:
        remedy = remedies.get(kind, details["msg"])
    return Problem(file=file, line=marked.line(inner), name=".".join(inner), value=value, unit=unit, remedy=remedy)


def _known_keys(schema: type[BaseModel], path: Path) -> list[str]:
    """Return the keys that a schema allows at ``path``; the keys of a dictionary are free."""
    model = schema
    for key in path:
        entry = model.model_fields.get(key)
        model = model if entry is None else next(_models(entry.annotation), model)
    return [name.rstrip("_") for name in model.model_fields]


def _models(annotation: Any) -> Iterator[type[BaseModel]]:
    """Yield the pydantic models in a type, as in ``dict[str, Entry] | None``."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _models(part)
