"""Truth and fitter share no physics: neither imports the other, directly or through other modules."""

import ast
from functools import cache
from pathlib import Path

import pytest

import belt_sim

ROOT = Path(belt_sim.__file__).parent
FITTER = ("belt_sim.line", "belt_sim.line", "belt_sim.effects", "belt_sim.diagnosis", "belt_sim.discovery")
TRUTH = ("belt_sim.virtual_rig",)


def modules() -> dict[str, Path]:
    """Dotted name -> file of every module of the project."""
    found = {}
    for path in ROOT.rglob("*.py"):
        parts = path.relative_to(ROOT.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imported(name: str, path: Path, known: dict[str, Path]) -> set[str]:
    """Modules of the project that one file imports, parent packages included; not what only type checkers read."""
    found = set()
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    tree = ast.parse(path.read_text())
    of_types = [n for n in ast.walk(tree) if isinstance(n, ast.If) and ast.unparse(n.test) == "TYPE_CHECKING"]
    skipped = {id(node) for part in of_types for below in part.body for node in ast.walk(below)}
    for node in ast.walk(tree):
        if id(node) in skipped:
            continue
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            source = ".".join([*above, *([node.module] if node.module else [])])
            found |= {source} | {f"{source}.{alias.name}" for alias in node.names}
    parents = {m.rsplit(".", k)[0] for m in found for k in range(1, m.count(".") + 1)}
    return (found | parents) & known.keys()


@cache
def arrows() -> dict[str, set[str]]:
    """Module -> modules that it imports."""
    known = modules()
    return {name: imported(name, path, known) for name, path in known.items()}


def reach(packages: tuple[str, ...]) -> set[str]:
    """Everything that the modules of these packages import, to any depth."""
    edges = arrows()
    waiting = [m for m in edges if inside(m, packages)]
    seen = set(waiting)
    while waiting:
        fresh = edges[waiting.pop()] - seen
        seen |= fresh
        waiting += fresh
    return seen


def inside(module: str, packages: tuple[str, ...]) -> bool:
    return any(module == p or module.startswith(p + ".") for p in packages)


@pytest.mark.parametrize(("mine", "forbidden"), [(TRUTH, FITTER), (FITTER, TRUTH)])
def test_truth_and_fitter_do_not_import_each_other(mine, forbidden):
    reached = reach(mine)
    assert any(inside(m, mine) for m in reached)
    assert [m for m in sorted(reached) if inside(m, forbidden)] == []


def test_the_search_sees_through_other_modules():
    """A guard that finds nothing must be able to find something: elements are reached through the 3D engines."""
    assert "belt_sim.space.elastic" in reach(TRUTH)
    assert "belt_sim.units" in reach(TRUTH)
