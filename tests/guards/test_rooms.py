"""The house: rooms of belt_sim know each other one way, on as few floors as were reached, and a public name has one
meaning."""

import ast
from collections import defaultdict

from belt_sim.io import PACKAGE
from studies.site.architecture import arrows, circles, floors

FLOORS = 12
OF_ENGINES = {"simulate", "simulate_batch"}  # what an engine of the 3D belt offers has the names of bs and bs.mjx


def test_no_two_rooms_know_each_other_and_floors_do_not_grow():
    imports = arrows()
    assert circles(imports) == set()
    assert max(floors(imports).values()) < FLOORS


def test_a_public_function_class_or_constant_has_a_name_of_its_own():
    homes = defaultdict(set)
    for path in PACKAGE.rglob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = [node.name] if isinstance(node, ast.FunctionDef | ast.ClassDef) else []
            targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
            parts = [part for t in targets for part in (t.elts if isinstance(t, ast.Tuple) else [t])]
            names += [part.id for part in parts if isinstance(part, ast.Name)]
            for name in names:
                homes[name].add(str(path.relative_to(PACKAGE)))
    public = {n: sorted(places) for n, places in homes.items() if not n.startswith("_") and n not in OF_ENGINES}
    assert {n: places for n, places in public.items() if len(places) > 1} == {}
