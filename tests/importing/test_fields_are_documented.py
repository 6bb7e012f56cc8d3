"""docs/campaign_files.md has a row for every field that the loader knows, with what stands for it when it is absent."""

import re
import types
import typing

import pytest
from pydantic import BaseModel

from belt_sim.campaign.folder import RATES, RUN_NUMBERS, RUNS_COLUMNS
from belt_sim.campaign.folder import REQUIRED as REQUIRED_RUNS
from belt_sim.campaign.sheet import RESERVED, CampaignEntry, QuantityEntry
from belt_sim.campaign.types import PLACES, Run
from belt_sim.io import ROOT

TEXT = (ROOT / "docs" / "campaign_files.md").read_text(encoding="utf-8")


def part(file: str) -> str:
    """What the page says of one file."""
    return TEXT.split(f"## {file}\n", 1)[1].split("\n## ", 1)[0]


def rows(file: str) -> dict[str, list[str]]:
    """Field -> cells of its row."""
    lines = [[c.strip() for c in line[1:-1].split("|")] for line in part(file).splitlines() if line.startswith("| `")]
    return {name: cells for cells in lines for name in re.findall(r"`([\w.]+)`", cells[0])}


def models_in(annotation) -> list[type[BaseModel]]:
    """The models that an annotation holds, in unions, dictionaries and annotated types too."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    inner = typing.get_args(annotation) if not isinstance(annotation, types.GenericAlias) else annotation.__args__
    return [m for a in inner for m in models_in(a)]


def fields(model: type[BaseModel], path: str = "") -> dict[str, bool]:
    """Dotted name of every field -> whether it is required; a quantity is one field."""
    found: dict[str, bool] = {}
    for name, field in model.model_fields.items():
        key = f"{path}{name.rstrip('_')}"
        found[key] = field.is_required()
        for inner in models_in(field.annotation):
            if inner is not QuantityEntry:
                found |= fields(inner, f"{key}.NAME." if key == "signals" else f"{key}.")
    return found


FIELDS = fields(CampaignEntry)


def test_the_fields_are_found():
    assert {"machine.centre_distance", "signals.NAME.wander.length_m", "settings.yaw.u"} <= set(FIELDS)


@pytest.mark.parametrize("name", FIELDS)
def test_a_field_of_the_sheet_is_documented(name):
    cells = rows("campaign.yaml")[name]
    assert len(cells) == 4, f"{name}: field, unit, must be, if absent"
    assert ("error" in cells[-1]) == FIELDS[name] or name.startswith("machine.pulley")


def test_no_field_is_documented_that_the_loader_refuses():
    assert set(rows("campaign.yaml")) == set(FIELDS)


def test_columns_of_the_tables_are_documented():
    assert set(rows("runs.csv")) == set(RUNS_COLUMNS)
    assert set(rows("signals.csv")) == set(RESERVED)
    assert set(rows("steady.csv")) == {"run", *RATES, "u_rate"}


@pytest.mark.parametrize("column", RUNS_COLUMNS)
def test_defaults_of_a_run_are_documented(column):
    cells = rows("runs.csv")[column]
    if column in REQUIRED_RUNS:
        assert cells[-1] == "error"
    elif column in RUN_NUMBERS:
        name, bounds, blank = RUN_NUMBERS[column]
        default = getattr(Run(name="r", tension=1.0, yaw=0.0), name)
        known = default is not None
        assert (float(cells[-1]) == blank == default) if known else cells[-1].startswith("not known")
        assert column in ("direction", "yaw_at_m") or f"{bounds.high:g}" in cells[2]


def test_places_are_documented():
    said = part("campaign.yaml")
    for place in PLACES:
        assert place in said.replace("`point_1` ... `point_4`", "point_1 point_2 point_3 point_4"), place
