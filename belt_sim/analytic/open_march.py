"""The march over any number of steps that is known only when it runs: one compilation serves any travel and step."""

import jax
import jax.numpy as jnp

from belt_sim.analytic.affine import is_affine, marched
from belt_sim.analytic.composition import Composition
from belt_sim.analytic.stepping import observe, places_of, spans_of, start_of, stepper
from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.effects.around_engine import as_driven


def march_open(
    case: Case,
    effects,
    spacing,
    steps,
    *,
    model: Composition,
    room: int,
    slots: int,
    only: tuple[str, ...] = ("y", "tilt"),
) -> Curves:
    """The same with ``steps`` of ``spacing`` [m], each kept, that are known only when it runs: one compilation serves
    any travel and step.

    room: records that are returned (more than ``steps``; beyond the last step nothing changes any more); slots: of the
    wrap's history; only: which curves, of y, angle, moment and tilt.
    """
    case, acting = as_driven(case, effects), (*model.built_in, *effects)
    spans = spans_of(case, acting, model)
    rows = (
        marched(spans, spacing, steps, room, slots, only)
        if is_affine(acting)
        else _stepped(spans, spacing, steps, room, slots, only)
    )
    places, order = places_of(case)
    beyond = jnp.arange(room)[:, None] > steps
    rows = {n: jnp.where(beyond, row[steps], row[:room]) for n, row in rows.items()}
    curves = {n: (row - row[0] if n == "y" else row).T for n, row in rows.items()}
    curves = {n: rows[places if n in ("y", "angle") else order] for n, rows in curves.items()}
    return Curves(**({"travel": spacing * jnp.arange(room)} | curves))


def _stepped(spans, spacing, steps, room: int, slots: int, only) -> dict:
    """Rows (room, k) of what can be seen, step by step."""
    advance = stepper(spans, spacing)

    def one(k, loop):
        carry, rows = loop
        carry = advance(carry, k)
        seen = observe(carry, spans)
        return carry, {n: row.at[k + 1].set(seen[n]) for n, row in rows.items()}

    start = start_of(spans, slots)
    first = observe(start, spans)
    rows = {n: jnp.zeros((room, *first[n].shape)).at[0].set(first[n]) for n in only}
    return jax.lax.fori_loop(0, steps, one, (start, rows))[1]
