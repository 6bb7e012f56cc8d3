"""Dataclasses whose fields JAX traces, maps and differentiates."""

import dataclasses
from collections.abc import Iterable
from typing import Any, TypeVar

import jax

#: a float, a NumPy array or a JAX array: physics is the same for one case and for many
Numbers = Any
C = TypeVar("C", bound=Any)


def pytree(cls: type[C]) -> type[C]:
    """Register a dataclass with JAX: every field is a leaf, unless ``field(metadata={"static": True})``.

    The class's name is part of the structure: jax 0.10.2 compares the structures of registered dataclasses without
    their type, and would hand the compiled code of one effect to another with as many numbers.
    """
    names = [f.name for f in dataclasses.fields(cls) if not f.metadata.get("static")]
    static = [f.name for f in dataclasses.fields(cls) if f.metadata.get("static")]
    mark = f"{cls.__module__}.{cls.__qualname__}"

    def aux(x: C) -> tuple[Any, ...]:
        return (mark, *(getattr(x, n) for n in static))

    def flatten_with_keys(x: C) -> tuple[list[Any], tuple[Any, ...]]:
        return [(jax.tree_util.GetAttrKey(n), getattr(x, n)) for n in names], aux(x)

    def flatten(x: C) -> tuple[list[Any], tuple[Any, ...]]:
        return [getattr(x, n) for n in names], aux(x)

    def unflatten(marks: tuple[Any, ...], leaves: Iterable[Any]) -> C:
        new = object.__new__(cls)
        for name, value in (*zip(names, leaves, strict=True), *zip(static, marks[1:], strict=True)):
            object.__setattr__(new, name, value)
        return new

    jax.tree_util.register_pytree_with_keys(cls, flatten_with_keys, unflatten, flatten)
    return cls
