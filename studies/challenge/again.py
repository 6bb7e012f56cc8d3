"""Ablations on a challenge that is there: others answer its campaigns, nothing is drawn anew."""

from dataclasses import replace

from belt_sim.errors import InputError
from studies.challenge.answers import ANSWERS
from studies.challenge.courier import Task
from studies.challenge.run import results


def again(first: Task, count: int | None = None) -> list[tuple[Task, list[int]]]:
    """Task and seeds of everybody who is to answer the campaigns of ``first.of`` too; results go beside that folder.

    Of the folder's seeds those from first.seed on, ``count`` at most. The folder's own source and bootstraps hold.
    first.ablation: who is to answer; the one that the folder has been answered by already: all others.
    """
    assert first.of is not None
    there = [r for r in results(first.of) if r["truth"] is not None]
    if not there:
        raise InputError("of", first.of, "", "holds no results of a challenge")
    had, source, bootstraps = (there[0][n] for n in ("ablation", "source", "bootstraps"))
    who = [name for name in ANSWERS if name != had] if first.ablation == had else [first.ablation]
    seeds = [r["seed"] for r in there if r["seed"] >= first.seed][:count]
    names = {name: f"{source}_{name}".replace(":", "_") for name in who}
    return [
        (
            replace(
                first,
                source=source,
                bootstraps=bootstraps,
                ablation=name,
                others=False,
                advised=0,
                out=first.of.with_name(names[name]),
            ),
            seeds,
        )
        for name in who
    ]
