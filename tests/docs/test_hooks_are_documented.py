"""docs/write_an_effect.md has every hook of an effect, with its signature, its arguments' units and code that runs."""

import inspect
import re
import textwrap
from pathlib import Path

import pytest
from paper_cases import paper_case

from belt_sim.analytic.spans import held_answers
from belt_sim.effects.base import HOOKS, Effect
from belt_sim.effects.library import library
from belt_sim.effects.load import load_classes
from belt_sim.laws.span import beam_first_order
from belt_sim.paths import ROOT

TEXT = (ROOT / "docs" / "write_an_effect.md").read_text(encoding="utf-8")
ROUNDING = 1e-9  # of a span condensed in nine doublings
DOCUMENTED = (*HOOKS, "influence", "columns")
#: what an effect declares by name, besides the hooks
DECLARED = [n for n in Effect.__annotations__ if not n.startswith("_")]


def own_methods() -> set[str]:
    """What a subclass may override: everything Effect defines itself but what only asks or makes."""
    return {n for n, v in vars(Effect).items() if callable(getattr(Effect, n)) and not n.startswith("_")}


def section(hook: str) -> str:
    """The text under a hook's heading."""
    return TEXT.split(f"### `{hook}`\n", 1)[1].split("\n## ")[0].split("\n### ")[0]


def method(cls: type[Effect], hook: str):
    """The function behind a hook, of a class method too."""
    found = inspect.getattr_static(cls, hook)
    return getattr(found, "__func__", found)


def test_nothing_of_an_effect_is_left_out():
    headings = re.findall(r"^### `(\w+)`$", TEXT, re.MULTILINE)
    assert own_methods() - {"null", "is_null"} == set(DOCUMENTED) == set(headings)
    assert not [n for n in DECLARED if f"`{n}`" not in TEXT]


@pytest.mark.parametrize("hook", DOCUMENTED)
def test_a_hook_has_its_signature_units_and_an_example_from_the_library(hook):
    said = section(hook)
    arguments = ", ".join(inspect.signature(method(Effect, hook)).parameters)
    assert said.startswith(f"`{hook}({arguments})"), "the signature, first of all"
    assert hook == "influence" or re.search(r"\[[a-z/² ,]+\]", said), "units in brackets"
    named = re.search(r"From `([\w./]+)`:", said).group(1)
    classes = load_classes([str(ROOT / named)]) if named.endswith(".py") else library()
    cls = classes[Path(named).stem]
    code = re.search(r"```python\n(.*?)```", said, re.DOTALL).group(1)
    assert code.strip() == textwrap.dedent(inspect.getsource(method(cls, hook))).strip()


def test_a_lining_holds_like_a_spring_at_the_clamped_end():
    """A beam whose end is on a spring 1/c bears 4 EI/L / (1 + c 4 EI/L) newton metres per radian (any textbook)."""
    case = paper_case(1e-3)
    span = beam_first_order(case)
    clamped = 4.0 * span.bending / span.length
    lining = load_classes([str(ROOT / "models" / "effects" / "lining.py")])["lining"]
    for c in (0.0, 1e-6, 1e-4, 1.0):
        answer = held_answers(case, (lining(c=c),), span)
        assert span.bending * answer.runup[0, 2] == pytest.approx(clamped / (1.0 + c * clamped), rel=ROUNDING)
