"""The march where every effect is affine: its step is one matrix, worked out once, and what travel alone adds to it.

x = (y, alpha at both run-ups, yaw of both pulleys as it is). A step takes it, with where the belt leaves the pulleys
before and after, to x' = M (x, off, off') + f(travel). M is the derivative of the step as ``stepping`` does it, f that
step from a belt that lies straight; f comes for a block of steps at once, and what is left in the loop are sums.
"""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

from belt_sim.analytic.spans import Spans
from belt_sim.analytic.stepping import BEFORE, arcs_of, landed_off, observe, step_of, yaw_now
from belt_sim.effects.base import uses
from belt_sim.laws.runup import State, Yaw
from belt_sim.laws.wrap import RunOff

BLOCK = 64  # steps
_ASKED = ("yaw", "runup", "bend", "slide", "wrap")  # hooks that a general march asks at every step


def is_affine(effects) -> bool:
    """Whether no effect needs more than sums at every step of a march."""
    return all(type(e).affine for hook in _ASKED for e in uses(effects, hook))


@dataclass(frozen=True)
class AffineMarch:
    """One case while it is traced; spacing [m] of the steps."""

    spans: Spans
    spacing: jax.Array

    @property
    def turns(self) -> bool:
        """Whether a pulley's yaw answers to where the belt lies, and so is part of x."""
        return any(type(e).last for e in uses(self.spans.effects, "yaw"))

    @property
    def size(self) -> int:
        """Numbers in x."""
        return 6 if self.turns else 4

    def yaw(self, travel) -> Yaw:
        """Of pulleys on which the belt lies straight."""
        spans, none = self.spans, jnp.zeros(2)
        commanded = yaw_now((), spans.case, travel, None)
        blank = spans.state(travel, BEFORE, none, none, RunOff(y=none, alpha=none), commanded)
        return yaw_now(spans.effects, spans.case, travel, blank)

    def state(self, x, off: RunOff, travel) -> tuple[State, Yaw]:
        """The instant that x stands for, and the yaw there."""
        yaw = self.yaw(travel)
        if self.turns:
            yaw = replace(yaw, tail=x[4], head=x[5])
        return self.spans.state(travel, BEFORE, x[:2], x[2:4], off, yaw), yaw

    def step(self, given, travel):
        """x after a step from ``travel`` [m]; given: x, then y and alpha of the run-offs before and after."""
        x, off, off1 = given[: self.size], given[self.size : -4], given[-4:]
        off, off1 = (RunOff(y=o[:2], alpha=o[2:]) for o in (off, off1))
        now, _ = self.state(x, off, travel)
        then, yaw = step_of(self.spans, self.spacing)(now, off, off1, travel)
        return jnp.concatenate([then.y, then.alpha] + ([jnp.stack([yaw.tail, yaw.head])] if self.turns else []))

    def matrix(self):
        """M, one row a given number: (size + 8, size)."""
        return jax.jacfwd(self.step)(jnp.zeros(self.size + 8), jnp.zeros(())).T

    def added(self, steps):
        """What travel alone adds to x (n, size) and to the run-offs after (n, 4), for steps by number (n,)."""
        none = jnp.zeros(self.size + 8)

        def one(k):
            travel = k * self.spacing
            zero = RunOff(y=jnp.zeros(2), alpha=jnp.zeros(2))
            now, _ = self.state(none[: self.size], zero, travel)
            off = landed_off(self.spans, zero, now, travel + self.spacing)
            return self.step(none, travel), jnp.concatenate([off.y, off.alpha])

        return jax.vmap(one)(steps)

    def observed(self, k, x, off):
        """What can be seen after step k."""
        off = RunOff(y=off[:2], alpha=off[2:])
        now, yaw = self.state(x, off, k * self.spacing)
        return observe((None, now, off, yaw), self.spans)


def start_of(march: AffineMarch):
    """x of a belt that lies straight."""
    yaw = march.yaw(0.0)
    return jnp.concatenate([jnp.zeros(4), jnp.stack([yaw.tail, yaw.head])])[: march.size]


def marched(spans: Spans, spacing, steps, room: int, slots: int, only) -> tuple[dict, dict]:
    """Rows (records, k) of what can be seen, by name of ``only``, at least ``room`` of them; and the last that counts.

    slots: of history, more than a wrapped arc has steps.
    """
    march = AffineMarch(spans, spacing)
    matrix, start = march.matrix(), start_of(march)
    back = arcs_of(spans.case) / spacing
    whole = jnp.floor(back).astype(int)
    first = march.observed(0, start, jnp.zeros(4))
    blocks = -(-room // BLOCK)
    rows = {n: jnp.zeros((1 + blocks * BLOCK, *first[n].shape)).at[0].set(first[n]) for n in only}
    history = jnp.zeros((slots, march.size)).at[-1].set(start)

    def block(b, loop):
        history, off, rows = loop
        k = b * BLOCK + jnp.arange(BLOCK)
        added, shift = march.added(k)
        xs, offs = advanced(history, off, matrix, added, shift, whole, back - whole)
        seen = jax.vmap(march.observed)(k + 1, xs, offs)
        at = b * BLOCK + 1
        rows = {n: jax.lax.dynamic_update_slice_in_dim(row, seen[n], at, 0) for n, row in rows.items()}
        return jnp.concatenate([history, xs])[-slots:], offs[-1], rows

    _, _, rows = jax.lax.fori_loop(0, -(-steps // BLOCK), block, (history, jnp.zeros(4), rows))
    return rows


@jax.custom_batching.custom_vmap
def advanced(history, off, matrix, added, shift, whole, part):
    """x (n, size) and run-offs (n, 4) after every step of a block, one after another.

    history (slots, size): x of the steps before; off (4,): run-offs now; matrix (size + 8, size); added (n, size),
    shift (n, 4): what travel alone adds to either; whole, part (2,): steps that a wrapped arc has.
    """
    found = _advanced(*(a[..., None] for a in (history, off, matrix, added, shift)), whole, part[:, None])
    return tuple(x[..., 0] for x in found)


@advanced.def_vmap
def _many(size, batched, history, off, matrix, added, shift, whole, part):
    """The same of many runs, which stand last in memory: sums of neighbours are what a processor does best."""
    if batched[5]:
        found = [
            jax.lax.map(
                lambda a: advanced(*a),
                tuple(
                    a if b else jnp.broadcast_to(a, (size, *a.shape))
                    for a, b in zip((history, off, matrix, added, shift, whole, part), batched, strict=True)
                ),
            )
        ]
        return found[0], (True, True)
    last = [
        jnp.moveaxis(a, 0, -1) if b else a[..., None]
        for a, b in zip((history, off, matrix, added, shift, part), (*batched[:5], batched[6]), strict=True)
    ]
    history, off, matrix, added, shift, part = (jnp.broadcast_to(a, (*a.shape[:-1], size)) for a in last)
    found = _advanced(history, off, matrix, added, shift, whole, part)
    return tuple(jnp.moveaxis(x, -1, 0) for x in found), (True, True)


def _advanced(history, off, matrix, added, shift, whole, part):
    """The same of arrays with one more axis, of runs."""
    slots, size = history.shape[:2]
    steps = len(added)
    near, far = 1.0 - part, part

    def late(xs, i):
        """Run-offs i steps into the block, of what ran up a wrapped arc ago."""
        tail, head = (near[p] * xs[slots + i - whole[p]] + far[p] * xs[slots + i - whole[p] - 1] for p in (0, 1))
        return jnp.stack([tail[0], head[1], tail[2], head[3]])

    def one(i, loop):
        xs, offs, x, off = loop
        off1 = late(xs, i) + shift[i]
        given = [*x, *off, *off1]
        x = added[i]
        for row, number in zip(matrix, given, strict=True):
            x = x + row * number
        return xs.at[slots + i].set(x), offs.at[i].set(off1), x, off1

    xs = jnp.concatenate([history, jnp.zeros_like(added)])
    offs = jnp.zeros((steps, *off.shape))
    xs, offs, _, _ = jax.lax.fori_loop(0, steps, one, (xs, offs, history[-1], off))
    return xs[slots:], offs
