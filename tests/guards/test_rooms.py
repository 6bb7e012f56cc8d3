"""The house: rooms of belt_sim know each other one way, on as few floors as were reached, and a public name has one
meaning."""

import ast
from collections import defaultdict

from belt_sim.io import PACKAGE
from studies.site.architecture import arrows, circles, floors

FLOORS = 12
#: official names of bs and of bs.mjx
ALIKE = {"prepare", "scene"}


def test_no_two_rooms_know_each_other_and_floors_do_not_grow():
    imports = arrows()
    assert circles(imports) == set()
    assert max(floors(imports).values()) < FLOORS


def test_a_public_function_or_class_has_a_name_of_its_own():
    homes = defaultdict(list)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.FunctionDef | ast.ClassDef) and not node.name.startswith("_"):
                homes[node.name].append(str(path.relative_to(PACKAGE)))
    alike = {name: places for name, places in homes.items() if len(places) > 1 and name not in ALIKE}
    assert alike == {}
