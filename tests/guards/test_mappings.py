"""A process may compile as much as it likes: what it has compiled is given back before its mappings run out."""

import jax.numpy as jnp
import numpy as np
import pytest

from belt_sim import mappings
from belt_sim.jax_setup import compiled
from belt_sim.stored_code import kept


def _sorted_sines(k: float):
    def function(x):
        for i in range(20):
            x = jnp.sort(jnp.sin(x) * k + i) @ jnp.ones((30, 30))
        return x

    return function


@pytest.fixture
def small_limit(monkeypatch, tmp_path):
    """A limit that some ten programs of the test reach."""
    monkeypatch.setattr(mappings, "PAUSE", 0.0)
    with monkeypatch.context() as all_forgotten:
        all_forgotten.setattr(mappings, "SHARE", 0.0)
        mappings.make_room()
    few = tmp_path / "max_map_count"
    few.write_text(str(int((mappings.mappings() + 600) / mappings.SHARE)))
    monkeypatch.setattr(mappings, "_LIMIT", few)
    return (mappings.mappings() + 600) / mappings.SHARE


@pytest.mark.skipif(not mappings.mappings(), reason="this system does not say how many mappings a process has")
@pytest.mark.parametrize("made", [lambda k: compiled(_sorted_sines(k)), lambda k: kept(_sorted_sines(k), None)])
def test_a_process_that_goes_on_compiling_never_comes_near_the_limit(small_limit, made):
    x = np.ones((30, 30))
    functions = [made(0.1 * k) for k in range(40)]
    most, before = 0, [function(x) for function in functions[:2]]
    for function in functions:
        function(x)
        most = max(most, mappings.mappings())
    assert 0.2 * small_limit < most < 0.8 * small_limit
    assert np.array_equal([function(x) for function in functions[:2]], before)


def test_where_there_is_no_limit_nothing_is_forgotten(monkeypatch, tmp_path):
    monkeypatch.setattr(mappings, "_LIMIT", tmp_path / "none")
    monkeypatch.setattr(mappings, "PAUSE", 0.0)
    assert not mappings.make_room()
