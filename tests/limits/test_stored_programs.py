"""Programs on disk give the same bits as those compiled now, and are never those of other code."""

import functools
import hashlib
import sys
from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from jax.experimental import serialize_executable
from paper_cases import paper_case

from belt_sim import jax_setup
from belt_sim.discovery.responses import Pulse
from belt_sim.effects.base import Effect, effect, library, parameter
from belt_sim.jax_setup import STORED, StoredProgram, program_key
from belt_sim.line.spans import runup_weights
from belt_sim.model import MODELS


@pytest.fixture
def folder(tmp_path):
    """JAX's folder of programs, empty."""
    before = jax.config.values["jax_compilation_cache_dir"]
    jax.config.update("jax_compilation_cache_dir", str(tmp_path))
    yield tmp_path / STORED
    jax.config.update("jax_compilation_cache_dir", before)


def traced(log):
    """A function that notes every time it is traced."""

    def function(x, pair):
        log.append(x)
        return {"sine": jax.numpy.sin(x) * pair["a"] + pair["b"], "pair": (x, [2.0 * x])}

    return function


def test_a_program_is_traced_once_and_then_read(folder):
    log: list = []
    arguments = np.linspace(0.0, 1.0, 5), {"a": 2.0, "b": np.ones(5)}
    first = StoredProgram(traced(log), "test")(*arguments)
    assert len(log) == 1
    assert len(list(folder.glob("*.program"))) == 1
    again = StoredProgram(traced(log), "test")(*arguments)
    assert len(log) == 1
    assert again["sine"].dtype == np.float64
    assert jax.tree.all(jax.tree.map(np.array_equal, first, again))


@pytest.mark.parametrize(("key", "size", "programs"), [("other", 5, 1), ("test", 6, 2)])
def test_what_shapes_a_trace_is_in_its_name_and_equal_programs_are_compiled_once(folder, key, size, programs):
    log: list = []
    first = StoredProgram(traced(log), "test")(np.ones(5), {"a": 2.0, "b": 1.0})
    for _ in range(2):  # traced, then read
        again = StoredProgram(traced(log), key)(np.ones(size), {"a": 2.0, "b": 1.0})
        assert np.array_equal(again["sine"][:5], first["sine"])
    assert len(log) == 2
    assert len(list(folder.glob("*.program"))) == programs


def test_a_damaged_file_is_made_anew(folder):
    log: list = []
    first = StoredProgram(traced(log), "test")(np.ones(3), {"a": 2.0, "b": 1.0})
    for file in folder.iterdir():
        file.write_bytes(file.read_bytes()[:100])
    again = StoredProgram(traced(log), "test")(np.ones(3), {"a": 2.0, "b": 1.0})
    assert np.array_equal(again["sine"], first["sine"])
    assert len(log) == 2


def test_a_foreign_file_of_a_right_digest_is_made_anew(folder):
    log: list = []
    StoredProgram(traced(log), "test")(np.ones(3), {"a": 2.0, "b": 1.0})
    (file,) = folder.glob("*.program")
    file.write_bytes(hashlib.sha256(b"hello world(\nxyz").digest() + b"hello world(\nxyz")
    again = StoredProgram(traced(log), "test")(np.ones(3), {"a": 2.0, "b": 1.0})
    assert np.array_equal(again["sine"], 2.0 * np.sin(np.ones(3)) + 1.0)


def test_nothing_is_left_that_nobody_finds_again(folder):
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    StoredProgram(traced([]), "test")(np.ones(3), {"a": 2.0, "b": 1.0})
    assert not list(folder.parent.glob("*program_*"))


def test_weights_of_a_users_own_law_are_not_kept(folder):
    @effect
    class Stiff(Effect):
        """An effect of a user, of one name and several laws."""

        law = "drive"
        reference = "none"
        size: float = parameter("1", "size", plausible=(0.0, 1.0), scale=1.0)

    model = replace(MODELS["strip"], built_in=(Stiff(size=0.5),))
    mine = runup_weights(paper_case(20.0, 0.0), model)
    assert not folder.exists()
    assert mine == runup_weights(paper_case(20.0, 0.0), MODELS["strip"])


def refuse(*_, **__):
    raise TypeError("another interface")


@pytest.fixture
def asked_again():
    """Whether JAX can keep programs is asked once a process: here anew."""
    jax_setup._can_store.cache_clear()
    yield
    jax_setup._can_store.cache_clear()


@pytest.mark.parametrize("without", ["module", "serialize", "deserialize_and_load"])
def test_where_jax_cannot_keep_a_program_it_is_compiled_as_usual(folder, monkeypatch, asked_again, without):
    arguments = np.ones(3), {"a": 2.0, "b": 1.0}
    log: list = []
    wanted = StoredProgram(traced(log), "test")(*arguments)  # and keeps it: what is there cannot be read any more
    parts = SimpleNamespace(**vars(serialize_executable) | {without: refuse})
    monkeypatch.setattr(jax_setup, "serialize_executable", None if without == "module" else parts)
    given = StoredProgram(traced(log), "test")(*arguments), StoredProgram(traced(log), "other")(*arguments)
    assert all(np.array_equal(each["sine"], wanted["sine"]) for each in given)
    assert len(list(folder.glob("*.program"))) == 1


def test_a_program_that_jax_cannot_write_is_used_all_the_same(folder, monkeypatch, asked_again):
    assert jax_setup._can_store()
    monkeypatch.setattr(jax_setup, "serialize_executable", SimpleNamespace(serialize=refuse))
    given = StoredProgram(traced([]), "test")(np.ones(3), {"a": 2.0, "b": 1.0})
    assert np.array_equal(given["sine"], 2.0 * np.sin(np.ones(3)) + 1.0)
    assert not folder.exists()


def test_without_the_pass_that_leaves_places_out_a_program_is_kept_with_them(folder, monkeypatch):
    monkeypatch.setitem(sys.modules, "jaxlib.mlir.passmanager", None)
    StoredProgram(traced([]), "test")(np.ones(3), {"a": 2.0, "b": 1.0})
    assert len(list(folder.glob("*.program"))) == 1


def test_code_that_is_not_the_packages_own_is_not_kept(folder):
    @effect
    class Mine(Effect):
        """An effect of a user."""

        law = "drive"
        reference = "none"
        size: float = parameter("1", "size", plausible=(0.0, 1.0), scale=1.0)

    strip, taper = MODELS["strip"], library()["taper"]
    assert program_key("march", strip, [taper])
    assert program_key("march", strip, [Mine]) is None
    assert program_key("march", replace(strip, span=lambda case: strip.span(case)), [taper]) is None
    assert program_key("march", replace(strip, built_in=(Mine(size=0.5),)), []) is None
    StoredProgram(traced([]), None)(np.ones(3), {"a": 2.0, "b": 1.0})
    assert not folder.exists()


def own_hook(self, runup, state, case):
    return runup


def own_name(cls):
    return cls.__name__


@pytest.mark.parametrize(
    ("name", "put"),
    [
        ("runup", lambda taper: own_hook),
        ("runup", lambda taper: functools.wraps(taper.runup)(own_hook)),
        ("runup", lambda taper: functools.partialmethod(own_hook)),
        ("runup", lambda taper: functools.partial(taper.runup)),
        ("runup", lambda taper: library()["crown"].runup),
        ("is_additive", lambda taper: classmethod(functools.wraps(Effect.is_additive)(own_name))),
        ("kappa_t", lambda taper: property(own_name)),
    ],
)
def test_a_class_of_the_package_with_a_hook_put_into_it_is_not_kept(monkeypatch, name, put):
    """Whatever the hook says of itself: the next process, without it, would read its program."""
    taper = library()["taper"]
    monkeypatch.setattr(taper, name, put(taper))
    assert program_key("march", MODELS["strip"], [taper]) is None


def test_what_a_class_holds_is_in_the_name_of_its_programs(monkeypatch):
    strip, taper = MODELS["strip"], library()["taper"]
    names = [program_key("march", strip, [taper])]
    monkeypatch.setattr(taper, "stage", 7)
    names.append(program_key("march", strip, [taper]))
    monkeypatch.setattr(taper, "runup", None)
    names.append(program_key("march", strip, [taper]))
    assert len({*names} - {None}) == 3


def test_every_effect_and_model_of_the_package_is_kept():
    for model in MODELS.values():
        key = program_key("march", model, [*library().values(), Pulse])
        assert key
        assert " at 0x" not in key  # an address is another in the next process, which would compile anew
