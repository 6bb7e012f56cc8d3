"""Whatever is wrong with a user's effect file is one line that names file, line and remedy."""

from fractions import Fraction

import jax.numpy as jnp
import numpy as np
import pytest

from belt_sim import simulate
from belt_sim.api.simulate import effects_of
from belt_sim.effects.base import library
from belt_sim.effects.load import load_effects
from belt_sim.errors import InputError

HEAD = '''"""A file of a user's."""

from dataclasses import dataclass, field, replace

from belt_sim.effects.base import Effect, Parameter, effect


{decorator}
@dataclass(frozen=True, kw_only=True)
class Mine(Effect):
    """Mine."""

    id = "mine_{name}"
    law = "{law}"
    parameters = {{"load": Parameter(unit="{unit}", meaning="load", plausible=(-5, 5), scale=0.01)}}
    load: float = 0.0
'''
RUNUP = "    def runup(self, runup, state, case):\n"
#: name -> (hook, what differs in the head, line, what the message must hold)
WRONG = {
    "undecorated": (RUNUP + "        return runup\n", {"decorator": "# no decorator"}, 9, "write @effect above"),
    "beside": (
        RUNUP + "        return runup\n\nclass Second(Effect):\n    size: float = field(default=0.0)\n",
        {},
        21,
        "@effect above the class Second",
    ),
    "no_number": (
        RUNUP + "        return runup\n\n@effect\nclass Second(Effect):\n    law = 'run-up'\n",
        {},
        21,
        "Second.parameters = none: declare a number",
    ),
    "raises": (RUNUP + "        raise RuntimeError('boo')\n", {}, 19, "runup: RuntimeError: boo"),
    "nothing": (RUNUP + "        replace(runup)\n", {}, 18, "returns nothing; end it with return"),
    "branches": (RUNUP + "        return runup if self.load > 0 else runup\n", {}, 19, "jnp.where"),
    "floats": (RUNUP + "        float(self.load)\n        return runup\n", {}, 19, "jax.numpy"),
    "signature": (
        "    def runup(self, runup):\n        return runup\n",
        {},
        18,
        "write runup(self, runup, state, case)",
    ),
    "mistyped": ("    def run_up(self, a, b, c):\n        return a\n", {}, 18, "did you mean runup?"),
    "no_hook": ("", {}, 8, "overrides no hook"),
    "unit": (RUNUP + "        return runup\n", {"unit": "furlong"}, 8, "furlong"),
    "law": (RUNUP + "        return runup\n", {"law": "span"}, 8, "law = 'span' but runup changes run-up"),
    "exits": ("import sys\nsys.exit(0)\n", {}, 19, "SystemExit"),
    "syntax": ("    def\n", {}, 18, "SyntaxError"),
}


@pytest.mark.parametrize("name", WRONG)
def test_one_line_says_where_and_what(name, tmp_path):
    hook, differs, line, says = WRONG[name]
    text = HEAD.format(**({"decorator": "@effect", "name": name, "law": "run-up", "unit": "N/m"} | differs))
    path = tmp_path / f"{name}.py"
    path.write_text(f"{text}\n{hook}", encoding="utf-8")
    with pytest.raises(InputError) as error:
        simulate(tension=40, travel=0.5, effects=[{"id": str(path), "load": 0.1}])
    message = str(error.value)
    assert f"{path}, line {line}: " in message
    assert says in message
    assert "\n" not in message


def test_a_helper_beside_an_effect_needs_no_decorator(tmp_path):
    path = tmp_path / "helped.py"
    text = HEAD.format(decorator="@effect", name="helped", law="run-up", unit="N/m")
    hook, helper = RUNUP + "        return runup\n", "\n\nclass Mixin(Effect):\n    width = 3.0\n"
    path.write_text(f"{text}\n{hook}{helper}", encoding="utf-8")
    assert [e.id for e in load_effects([{"id": str(path), "load": 0.1}])] == ["mine_helped"]
    path.write_text(f'{text}\n{hook}{helper}    id = "forgot"\n', encoding="utf-8")
    with pytest.raises(InputError, match="write @effect above the class Mixin"):
        load_effects([{"id": str(path), "load": 0.1}])


@pytest.mark.parametrize(
    "two", [np.int64(2), np.float32(2), np.array(2.0), np.array(2), jnp.float32(2), Fraction(2)], ids=repr
)
def test_every_real_scalar_is_a_number(two):
    slip = library()["slip"]
    assert effects_of([slip(inverse_friction=two)]) == (slip(inverse_friction=2.0),)
    assert simulate(tension=two, travel=0.5, model="rope").case.settings.tension == 2e6
    for wrong in (True, np.bool_(True), np.array([2.0]), np.float32("nan"), np.str_("x"), 2j):
        with pytest.raises(InputError, match="give a finite number"):
            effects_of([slip(inverse_friction=wrong)])


def test_a_value_that_no_machine_has_is_refused():
    with pytest.raises(InputError, match=r"effects\.taper\.kappa_t = 1e\+09 1/m: give at most 0\.1 1/m"):
        load_effects([{"id": "taper", "kappa_t": 1e9}])
    assert load_effects([{"id": "taper", "kappa_t": 2e-3}])  # beyond what is plausible, but somebody may want to see it
