"""Frozen dataclasses that JAX may look into, without the nouns knowing JAX's machinery."""

import dataclasses

import jax


def pytree(cls):
    """Register a dataclass with JAX: every field is a leaf, unless ``field(metadata={"static": True})``."""
    names = [f.name for f in dataclasses.fields(cls)]
    static = [f.name for f in dataclasses.fields(cls) if f.metadata.get("static")]
    jax.tree_util.register_dataclass(cls, [n for n in names if n not in static], static)
    return cls
