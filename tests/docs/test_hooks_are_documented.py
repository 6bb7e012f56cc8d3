"""docs/write_an_effect.md has every hook of an effect, with its signature, its arguments' units and code that runs."""

import inspect
import re
import textwrap

import pytest

from belt_sim.effects.base import HOOKS, Effect
from belt_sim.effects.library import library
from belt_sim.effects.load import load_classes
from belt_sim.paths import ROOT

TEXT = (ROOT / "docs" / "write_an_effect.md").read_text(encoding="utf-8")
DOCUMENTED = (*HOOKS, "influence", "columns")
#: what an effect declares by name, besides the hooks
DECLARED = [n for n in Effect.__annotations__ if not n.startswith("_")]


def own_methods() -> set[str]:
    """What a subclass may override: everything Effect defines itself but what only asks or makes."""
    return {n for n, v in vars(Effect).items() if callable(getattr(Effect, n)) and not n.startswith("_")}


def section(hook: str) -> str:
    """The text under a hook's heading."""
    return TEXT.split(f"### `{hook}`\n", 1)[1].split("\n## ")[0].split("\n### ")[0]


def test_nothing_of_an_effect_is_left_out():
    assert own_methods() - {"null", "is_null"} == set(DOCUMENTED)
    assert re.findall(r"^### `(\w+)`$", TEXT, re.MULTILINE) and set(
        re.findall(r"^### `(\w+)`$", TEXT, re.MULTILINE)
    ) == set(DOCUMENTED)
    assert not [n for n in DECLARED if f"`{n}`" not in TEXT]


@pytest.mark.parametrize("hook", DOCUMENTED)
def test_a_hook_has_its_signature_units_and_an_example_from_the_library(hook):
    said = section(hook)
    arguments = list(
        inspect.signature(
            inspect.unwrap(vars(Effect)[hook].__func__ if hook == "columns" else getattr(Effect, hook))
        ).parameters
    )
    assert said.startswith(f"`{hook}({', '.join(arguments)})"), "the signature, first of all"
    assert hook == "influence" or re.search(r"\[[a-z/² ,]+\]", said), "units in brackets"
    name = re.search(r"From `([\w./]+)`:", said).group(1)
    classes = load_classes([str(ROOT / name)]) if name.endswith(".py") else library()
    (cls,) = [c for c in classes.values() if c.id == name or name.endswith(f"{c.id}.py")]
    code = re.search(r"```python\n(.*?)```", said, re.DOTALL).group(1)
    source = inspect.getsource(inspect.getattr_static(cls, hook).__func__ if hook == "columns" else getattr(cls, hook))
    assert code.strip() == textwrap.dedent(source).strip()
