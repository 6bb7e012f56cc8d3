"""One text of the mechanics for NumPy, step by step in the native engine, and for JAX, compiled and in batches."""

from types import ModuleType
from typing import Any

import jax.numpy as jnp
import numpy as np

from belt_sim.pytrees import Numbers as Array


def library_of(values: Array) -> ModuleType:
    """NumPy for its arrays and for plain numbers, jax.numpy for JAX's arrays and tracers."""
    return np if isinstance(values, (np.ndarray, np.generic, float)) else jnp


def put(array: Array, index: Any, values: Array) -> Array:
    """A copy of the array with ``values`` at an index."""
    if isinstance(array, np.ndarray):
        copy = array.copy()
        copy[index] = values
        return copy
    return array.at[index].set(values)


def add_at(array: Array, index: Any, values: Array) -> Array:
    """A copy of the array with ``values`` added at an index that names no place twice."""
    if isinstance(array, np.ndarray):
        copy = array.copy()
        copy[index] += values
        return copy
    return array.at[index].add(values)


def smoothstep(u: Array) -> Array:
    """From 0 at u = 0 to 1 at 1 and beyond, 3 u^2 - 2 u^3."""
    u = library_of(u).minimum(u, 1.0)
    return u * u * (3.0 - 2.0 * u)
