"""Rules of the code that a machine can check: which package may import which."""

import ast
from functools import cache

import pytest

from belt_sim.io import ROOT

PRODUCT, STUDIES = (sorted((ROOT / part).rglob("*.py")) for part in ("belt_sim", "studies"))
FILES = [*PRODUCT, *STUDIES]
CORE = ("line", "effects")
OUTER = {
    "show",
    "results",
    "diagnosis",
    "api",
    "campaign",
    "virtual_rig",
    "space",
}


@cache
def imported(path) -> frozenset[str]:
    """Names of the modules that a file imports, at its top or inside."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            names |= {a.name for a in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module} | {f"{node.module}.{a.name}" for a in node.names}
    return frozenset(names)


def that_import(*packages: str) -> set[str]:
    """Files of FILES that import one of the packages: their parts below belt_sim, or studies/ and their names."""
    found = [p.relative_to(ROOT) for p in FILES if {m.split(".")[0] for m in imported(p)} & {*packages}]
    return {p.parts[1] if p.parts[0] == "belt_sim" else str(p) for p in found}


def test_only_the_command_line_knows_hydra():
    assert that_import("hydra") == {"commands"}


def test_the_product_does_not_know_its_studies():
    assert {p.split("/")[0] for p in that_import("studies")} == {"studies"}


def test_nobody_reads_arguments_by_other_means_than_hydra():
    assert that_import("argparse", "click", "typer", "fire") == set()


@pytest.mark.parametrize("part", CORE)
def test_the_core_imports_no_observer_and_no_engine(part):
    for path in (ROOT / "belt_sim" / part).glob("*.py"):
        others = {m.split(".")[1] for m in imported(path) if m.startswith("belt_sim.")}
        assert not others & OUTER


#: part -> the parts that it may not know, as they use it
ABOVE = {
    "results": ("diagnosis", "show", "api", "commands"),
    "diagnosis": ("show", "api", "commands"),
    "show": ("diagnosis", "api", "commands"),
    "api": ("commands",),
}


@pytest.mark.parametrize("part", ABOVE)
def test_arrows_point_one_way(part):
    known = {m.split(".")[1] for p in (ROOT / "belt_sim" / part).rglob("*.py") for m in imported(p) if "belt_sim." in m}
    assert known
    assert not known & set(ABOVE[part])


#: Files of a diagnosis, from the ground up: each knows those before it and no other.
STOREYS = (
    *(
        "samples",
        "forward",
        "noise",
        "fit",
        "workbench",
        "plausibility",
        "linearisation",
        "errors",
    ),
    *("decide", "search", "examine", "next_run", "describe", "foresight"),
)


@pytest.mark.parametrize("storey", STOREYS)
def test_a_storey_of_a_diagnosis_stands_on_those_below(storey):
    above = {f"belt_sim.diagnosis.{s}" for s in STOREYS[STOREYS.index(storey) + 1 :]}
    assert not imported(ROOT / "belt_sim" / "diagnosis" / f"{storey}.py") & above


def test_every_file_of_a_diagnosis_has_its_storey():
    assert {p.stem for p in (ROOT / "belt_sim" / "diagnosis").glob("*.py")} == {*STOREYS, "__init__"}


def test_the_line_model_does_not_know_the_effects():
    for path in (ROOT / "belt_sim" / "line").glob("*.py"):
        assert not any(m.startswith("belt_sim.effects") for m in imported(path)), path.name


def test_no_pickle():
    for path in FILES:
        assert not imported(path) & {"pickle", "joblib", "dill"}, path.name
