"""Guard: what is pinned installs on the oldest Python that the project is said to run on, to the last digit.

A distribution's own 3.11 may be 3.11.2; a pin that asks for 3.11.5 once made `make setup` fail there.
"""

import tomllib
from importlib.metadata import distributions
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[2]


def test_every_pin_takes_the_first_release_of_the_oldest_python():
    wanted = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["requires-python"]
    oldest = next(s.version for s in SpecifierSet(wanted) if s.operator == ">=") + ".0"
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pinned = {Requirement(line).name.lower().replace("_", "-") for line in lines if line and not line.startswith("#")}
    asks = {
        d.metadata["Name"]: d.metadata["Requires-Python"]
        for d in distributions()
        if d.metadata["Name"].lower().replace("_", "-") in pinned and d.metadata["Requires-Python"]
    }
    assert len(asks) > 50
    assert not {n: spec for n, spec in asks.items() if not SpecifierSet(spec).contains(oldest)}
