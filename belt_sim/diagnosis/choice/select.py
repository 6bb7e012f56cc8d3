"""Which effects are missing: thresholds from chance, then one decision (decide.py) on joint refits (refits.py)."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any, cast

from belt_sim.diagnosis.choice.chance import Chance, chance_of
from belt_sim.diagnosis.choice.decide import MAX_EFFECTS, NO_MACHINE, Ids, completed, decide, explanation
from belt_sim.diagnosis.choice.larger import larger
from belt_sim.diagnosis.choice.recalibration import Recalibration
from belt_sim.diagnosis.choice.refits import Refits, Trial
from belt_sim.diagnosis.choice.rise import without_a_rise
from belt_sim.diagnosis.fits.around import around
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import HeldOut, held_out
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.null import NullGains, null_gains
from belt_sim.diagnosis.left_over.openset import OpenSet, open_tests
from belt_sim.results.found import Explanation, best_explanation

#: false alarms of all candidates together; the open set and the search for laws spend half as much each and held-out
#: errors a tenth, so that all roads to one stay below the 5 % that are allowed
FAMILY_LEVEL = 0.02


@dataclass
class Selection:
    """The chosen fit on its workbench, the base fit on its own, every round's trials, and what could stand in the place
    of each chosen effect; larger: sets of one effect more; chance, null, critical: what all were judged by; gain: chi2
    of the chosen fit over the base, on one metric; bare_held_out: held-out errors of no effect, on that metric;
    evidence: refits of other sets, about the chosen one; table: the sets that were compared.
    """

    base_bench: Workbench
    bench: Workbench
    base: Fit
    chosen: Fit
    base_held_out: HeldOut
    bare_held_out: HeldOut
    held_out: HeldOut
    chance: Chance
    null: NullGains
    critical: float
    base_left: OpenSet
    rounds: Sequence[Sequence[Trial]] = ()
    swaps: dict[str, list[Trial]] = field(default_factory=dict)
    larger: Sequence[Trial] = ()
    gain: float = 0.0
    evidence: Refits | None = None
    table: tuple[Explanation, ...] = ()

    def threshold(self, name: str) -> float:
        """The gain of one effect that chance beats as seldom as agreed."""
        return self.null.threshold(name, self.critical)

    def instead(self, ids: Ids) -> "Selection":
        """The same with other effects chosen, judged about them."""
        assert self.evidence is not None
        return replace(self, **_about(self.evidence.moved(ids), ids))


def select(
    bench: Workbench,
    base: Fit,
    *,
    bootstraps: int,
    seed: int,
    limit: int = MAX_EFFECTS,
    tell: Callable[[str], None] = lambda text: None,
    tick: Callable[[int], None] = lambda n: None,
) -> Selection:
    """Choose up to ``limit`` effects where the ``base`` fit lacks them.

    tell hears what is being done, tick counts bootstrap replicates.
    """
    names = [c.id for c in bench.forward.classes]
    near = around(bench, base, names)
    shapes = {n: near.shapes(bench, n) for n in names}
    with ThreadPoolExecutor(2) as beside:  # what chance does is worked out beside what does not ask for it
        open_set = beside.submit(open_tests, bench, base, bootstraps=max(200, bootstraps // 2), seed=seed)
        chances = beside.submit(chance_of, bench, bench.samples.y - base.values, seed + 1)
        null = null_gains(bench, shapes, base.slopes, base.values, count=bootstraps, seed=seed, tick=tick)
        critical, tests = null.critical(names, FAMILY_LEVEL), open_set.result()
        again = Recalibration(bootstraps, seed + 3, FAMILY_LEVEL, bench.levels)
        first = Refits(bench, null, critical, chances.result(), near, fits={frozenset(): base}, recalibrated=again)
        decision = decide(first, limit=limit, tell=tell)
    held = held_out(bench, base)
    last, table = without_a_rise(decision, held)
    about = _about(last, best_explanation(table).effects)
    rounds = cast(Sequence[Sequence[Trial]], decision.rounds)
    table = completed(table, last, _neighbours(last, about, rounds))
    return Selection(
        base_bench=bench, base=base, base_held_out=held,
        rounds=rounds,
        base_left=tests.look(base.residual), table=table,
        **about,
    )  # fmt: skip


def _neighbours(last: Refits, about: dict[str, Any], rounds: Sequence[Sequence[Trial]]) -> Iterator[Explanation]:
    """The chosen set with one effect exchanged or one more; where nothing was chosen, every effect by itself."""
    for name, trials in about["swaps"].items():
        rest = tuple(i for i in about["chosen"].ids if i != name)
        (gain,) = last.gains([rest])
        yield from (_explanation(last, (*rest, t.id), gain + t.gain, t) for t in trials)
    yield from (_explanation(last, t.fit.ids, t.gain, t) for t in about["larger"])
    if not about["chosen"].ids and rounds:
        yield from (_explanation(last, (t.id,), t.gain, t) for t in rounds[0])


def _explanation(last: Refits, ids: Ids, gain: float, trial: Trial) -> Explanation:
    return replace(explanation(last, ids, gain), refused="" if trial.plausible else NO_MACHINE)


def _about(last: Refits, ids: Ids) -> dict[str, Any]:
    """What a selection says of the effects that are chosen, from the evidence about them."""
    chosen = last.fit(ids)
    swaps = {n: sorted(last.trials(tuple(i for i in ids if i != n)), key=lambda t: -t.score) for n in ids}
    return {
        "bench": last.bench,
        "chosen": chosen,
        "bare_held_out": last.held_out(()),
        "held_out": held_out(last.bench, chosen),
        "chance": last.chance,
        "null": last.null,
        "critical": last.critical,
        "swaps": swaps,
        "larger": larger(last, ids),
        "gain": last.gains([ids])[0],
        "evidence": last,
    }
