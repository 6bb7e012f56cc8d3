"""Batches of cases: the march, vmapped and jitted once, run chunk by chunk in a few threads.

A march is one long loop on one core. XLA releases Python's lock, so chunks run in parallel; a chunk is small enough for
its state to stay in a core's cache.
"""

from dataclasses import fields, replace
from functools import partial
from typing import Any

import jax
import numpy as np
from numpy.typing import ArrayLike

from belt_sim.case import Case, Schedule, Settings
from belt_sim.curves import Curves
from belt_sim.errors import InputError
from belt_sim.jax_setup import WORKERS, jit_float64, map_in_chunks
from belt_sim.line.march import KEEP, STEP, march_traced, plan_steps
from belt_sim.line.spans import Composition

CHUNK = 250  # cases
Axes = Any  # 0 or None for every leaf of a case, or for whole branches of it


def grid(case: Case, *, tensions: ArrayLike, yaws: ArrayLike) -> tuple[Case, Axes]:
    """Return (cases, axes) of every tension [Pa] with every yaw step [rad] of the tail pulley at travel 0.

    Row t * len(yaws) + k holds tensions[t] and yaws[k]; all else is as in ``case``, and shared.
    """
    tension, yaw = (x.ravel() for x in np.meshgrid(tensions, yaws, indexing="ij"))
    zero = np.zeros(1)
    schedule = Schedule(at=zero, over=zero, change=yaw[:, None])
    axes = Case(
        rig=None,  # type: ignore[arg-type]
        belt=None,  # type: ignore[arg-type]
        settings=Settings(
            tension=0,
            yaw=Schedule(at=None, over=None, change=0),
            yaw_head=None,  # type: ignore[arg-type]
            speed=None,
            direction=None,
            start=None,
            y0=None,
        ),
    )
    return replace(case, settings=replace(case.settings, tension=tension, yaw=schedule)), axes


def march_many(
    cases: Case,
    model: Composition,
    effects=(),
    *,
    travel: float,
    step: float = STEP,
    keep: float = KEEP,
    axes: Axes = 0,
    only: tuple[str, ...] = (),
    chunk: int = CHUNK,
    workers: int = WORKERS,
) -> Curves:
    """Return Curves of a batch, like ``march``; all arrays have a leading axis of cases (travel too).

    Args:
        axes: 0 for leaves of ``cases`` that carry a leading axis of cases, None for shared ones; a tree like ``cases``.
        only: names of the arrays of Curves to keep besides travel; empty keeps all (a curve of ten thousand cases and
            1000 records has 80 MB).
        chunk: cases per chunk.
        workers: number of threads.

    Raises:
        CannotRepresent, InputError: as ``march`` does.
    """
    model.admit(effects)
    wanted = _check_names(only)
    plan = plan_steps(cases, travel=travel, step=step, keep=keep)
    leaves, tree = jax.tree.flatten(cases)
    spread = _leaf_axes(axes, cases)
    run = partial(_batch, plan=plan, model=model, tree=tree, spread=spread, only=wanted)
    number = next((len(leaf) for leaf, axis in zip(leaves, spread, strict=True) if axis == 0), 0)
    if not number:
        raise InputError("cases", number, "", "give at least one case, and the axes along which cases differ")

    def piece(rows: np.ndarray) -> tuple[np.ndarray, ...]:
        part = tuple(np.asarray(x)[rows] if axis == 0 else x for x, axis in zip(leaves, spread, strict=True))
        return run(part, tuple(effects), travel)

    kept = map_in_chunks(piece, number, chunk, workers)
    return Curves(**({"y": None} | dict(zip(("travel", *wanted), kept, strict=True))))  # type: ignore[arg-type]


def _leaf_axes(axes: Axes, cases: Case) -> tuple[int | None, ...]:
    """Return the axis (0 or None) of every leaf of ``cases``."""

    def is_shared(x) -> bool:
        return x is None

    return tuple(jax.tree.leaves(jax.tree.broadcast(axes, cases, is_leaf=is_shared), is_leaf=is_shared))


def _check_names(only: tuple[str, ...]) -> tuple[str, ...]:
    known = tuple(f.name for f in fields(Curves) if f.name not in ("travel", "extra"))
    for name in only:
        if name not in known:
            raise InputError("only", name, "", f"use some of {', '.join(known)}")
    return tuple(only) or known


@partial(jit_float64, static_argnames=("plan", "model", "tree", "spread", "only"))
def _batch(leaves, effects, travel, *, plan, model: Composition, tree, spread, only):
    """Return travel and the arrays ``only`` of a batch, each with a leading axis of cases."""

    def one(*own):
        curves = march_traced(jax.tree.unflatten(tree, own), effects, travel, model=model, plan=plan)
        return tuple(getattr(curves, name) for name in ("travel", *only))

    return jax.vmap(one, in_axes=spread)(*leaves)
