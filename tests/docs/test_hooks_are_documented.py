"""docs/write_an_effect.md has every hook of an effect, with its signature and the units of its arguments."""

import inspect
import re

import pytest

from belt_sim.effects.base import HOOKS, Effect
from belt_sim.paths import ROOT

TEXT = (ROOT / "docs" / "write_an_effect.md").read_text(encoding="utf-8")
DOCUMENTED = (*HOOKS, "influence", "columns")
#: what an effect declares by name, besides the hooks
DECLARED = [n for n in Effect.__annotations__ if not n.startswith("_")]


def test_nothing_of_an_effect_is_left_out():
    headings = re.findall(r"^### `(\w+)`$", TEXT, re.MULTILINE)
    own = {n for n in vars(Effect) if callable(getattr(Effect, n)) and not n.startswith("_")}
    assert own - {"null", "is_null", "is_additive"} == set(DOCUMENTED) == set(headings)
    assert not [n for n in DECLARED if f"`{n}`" not in TEXT]


@pytest.mark.parametrize("hook", DOCUMENTED)
def test_a_hook_stands_there_with_its_signature_and_units(hook):
    said = TEXT.split(f"### `{hook}`\n", 1)[1].split("\n## ")[0].split("\n### ")[0]
    method = inspect.getattr_static(Effect, hook)
    arguments = ", ".join(inspect.signature(getattr(method, "__func__", method)).parameters)
    assert said.startswith(f"`{hook}({arguments})")
    assert hook == "influence" or re.search(r"\[[a-z/² ,]+\]", said)
