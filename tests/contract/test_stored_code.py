"""Compiled code is found again by what made it, and by nothing less."""

import os
from dataclasses import replace
from functools import partial
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from belt_sim import stored_code
from belt_sim.analytic.model import MODELS
from belt_sim.diagnosis.readings.forward import Forward, _one_run
from belt_sim.diagnosis.readings.samples import samples_of
from belt_sim.discovery.responses import _respond
from belt_sim.effects.library import library
from belt_sim.stored_code import kept, model_name, own, written_as
from belt_sim.virtual_rig import Plan, Setting, make_campaign


def small():
    """One run of a metre."""
    return make_campaign(seed=1, plan=Plan(runs=(Setting(tension=1e7, yaw=1e-4),), length=1.0))[0]


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setattr(stored_code, "_folder", lambda: tmp_path)
    return tmp_path


class Traced:
    """2 x + sum(y), and how often it was traced."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self, x, y):
        self.times += 1
        return 2.0 * x["a"] + jnp.sum(y)


def test_it_is_traced_once_for_a_shape_and_never_again_by_the_same_name(folder):
    first, again, other = Traced(), Traced(), Traced()
    x, y = {"a": 1.0 / 3.0}, np.arange(3.0)
    for _ in range(2):
        assert kept(first, "one")(x, y) == 2.0 / 3.0 + 3.0
    assert kept(again, "one")(x, y + 1.0) == 2.0 / 3.0 + 6.0
    assert kept(other, "another")(x, y) == 2.0 / 3.0 + 3.0
    assert (first.times, again.times, other.times) == (1, 0, 1)
    assert kept(again, "one")(x, np.arange(4.0)) == 2.0 / 3.0 + 6.0
    assert again.times == 1


def test_what_is_damaged_is_made_again(folder):
    kept(Traced(), "one")({"a": 1.0}, np.ones(2))
    (path,) = folder.iterdir()
    path.write_bytes(b"nonsense")
    again = Traced()
    assert kept(again, "one")({"a": 1.0}, np.ones(2)) == 4.0
    assert again.times == 1


def test_without_a_name_nothing_is_stored(folder):
    assert kept(Traced(), None)({"a": 1.0}, np.ones(2)) == 4.0
    assert not list(folder.iterdir())


def test_it_stands_in_jaxs_own_cache_or_nowhere(tmp_path):
    before = jax.config.jax_compilation_cache_dir
    find = stored_code._folder.__wrapped__
    try:
        jax.config.update("jax_compilation_cache_dir", None)
        assert find() is None
        jax.config.update("jax_compilation_cache_dir", str(tmp_path))
        for k in range(2 * stored_code.VERSIONS_KEPT):
            old = tmp_path / "traced" / str(k)
            old.mkdir(parents=True)
            os.utime(old, (2.0**32, 2.0**32))  # newer than the one in use, as far as a clock says
        assert find().is_dir()
        assert len(list((tmp_path / "traced").iterdir())) == stored_code.VERSIONS_KEPT
    finally:
        jax.config.update("jax_compilation_cache_dir", before)


def files_of(jaxpr) -> set[Path]:
    """Every file of this package that a traced function ran through."""
    found: set[Path] = set()
    for eqn in jaxpr.eqns:
        frames = eqn.source_info.traceback.frames if eqn.source_info.traceback else ()
        found |= {Path(f.file_name) for f in frames}
        for value in jax.tree.leaves(list(eqn.params.values()), is_leaf=lambda v: hasattr(v, "jaxpr")):
            inner = getattr(value, "jaxpr", value)
            found |= files_of(inner) if hasattr(inner, "eqns") else set()
    return {p for p in found if stored_code._HERE in p.parents}


@pytest.mark.parametrize("what", ["march", "responses"])
def test_all_code_that_is_traced_is_among_the_sources(what):
    samples = samples_of(small())
    forward = Forward(samples, MODELS["strip"], list(library().values()))
    run = jax.tree.map(lambda x: x[0], samples.cases.settings)
    case = replace(samples.cases, settings=run)
    shape = {"model": forward.model, "room": 64, "history": 16}
    with jax.enable_x64(True):
        if what == "march":
            told = (run, samples.travel[0], samples.time[0], samples.yaw_at[0], case.rig, case.belt, 0.1, 10)
            traced = jax.make_jaxpr(partial(_one_run, slots=forward.slots, only=("y", "tilt"), **shape))(
                forward.null(), np.ones(forward.size), *told
            )
        else:
            acting = forward.effects_at(forward.null(), list(library()))
            traced = jax.make_jaxpr(partial(_respond, **shape))(acting, case, 0.2, 0.1, 10)
    begun = {Path(__file__), *(Path(m.__file__) for m in (stored_code,))}
    ran = files_of(traced.jaxpr) - begun
    assert len(ran) > 10
    assert ran <= set(stored_code.sources())


def test_code_of_somebody_elses_effects_is_not_stored():
    class Cant(library()["cant"]):
        pass

    strip, cant = MODELS["strip"], library()["cant"]
    assert own(cant)
    assert not own(Cant)
    assert model_name(strip, cant)
    assert model_name(strip, Cant) is None
    assert len({model_name(m) for m in MODELS.values() if hasattr(m, "built_in")} - {None}) > 3


def test_laws_that_were_written_are_told_apart_by_what_is_traced_of_them():
    def law():
        return type("Found", (library()["cant"],), {"__module__": "found_effect_1"})

    one, alike, other = law(), law(), law()
    strip = MODELS["strip"]
    assert model_name(strip, one) is None
    for cls, words in ((one, "x"), (alike, "x"), (other, "x**2")):
        written_as(cls, words)
    assert model_name(strip, one) == model_name(strip, alike)
    assert len({model_name(strip, one), model_name(strip, other), model_name(strip)}) == 3
    assert not own(one)


def test_code_that_is_compiled_with_less_effort_says_the_same():
    points = np.linspace(0.1, 2.0, 50)
    quick, slow = (kept(lambda x: jnp.sin(x) ** 3 / (1.0 + x), None, brief)(points) for brief in (True, False))
    np.testing.assert_allclose(quick, slow, rtol=1e-14)
