"""From what was chosen and what it leaves to what is found: a set is found only if nothing is left with it."""

from collections.abc import Sequence
from dataclasses import dataclass

from belt_sim.campaign import Suspicion
from belt_sim.diagnosis.beside import members_that_stay, unknown_columns
from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.heldout import HeldOut, held_out
from belt_sim.diagnosis.ladder import Rung, better_model, ladder
from belt_sim.diagnosis.openset import OpenSet, open_set
from belt_sim.diagnosis.select import Selection
from belt_sim.results.verdict import Verdict
from belt_sim.results.words import listed

SHOWN = 3  # failed tests in a sentence


@dataclass(frozen=True)
class Judgement:
    """What stands after the tests.

    named: the fit of the effects that are found, the base fit when none is; left: the tests of what the named leave;
    base_left: the same of the base model; nearest: the set that explains most but not all, and the tests that it fails;
    use_model: another base model that explains more.
    """

    named: Fit
    named_held_out: HeldOut
    left: OpenSet
    base_left: OpenSet
    nearest: Fit | None = None
    fails: tuple[str, ...] = ()
    use_model: Rung | None = None

    @property
    def why(self) -> str:
        """Why the nearest known set is not the answer."""
        more = f" and {len(self.fails) - SHOWN} more" if len(self.fails) > SHOWN else ""
        return f"with it these tests still fail: {', '.join(self.fails[:SHOWN])}{more}" if self.fails else ""


def judged(found: Selection, *, bootstraps: int, seed: int) -> Judgement:
    """Test what the chosen set leaves; where that fails, keep only what is needed beside the unknown."""
    bench, chosen = found.bench, found.chosen
    first = found.base_left.and_failed(beyond_floor(found, found.base_held_out))
    if not chosen.ids:
        use = _better_model(found) if first.failed else None
        return Judgement(found.base, found.base_held_out, first, first, use_model=use)
    left = open_set(bench, chosen, bootstraps=bootstraps, seed=seed)
    left = left.and_failed(beyond_floor(found, found.held_out))
    use = _better_model(found)
    if use is None and not left.failed:
        return Judgement(chosen, found.held_out, left, first)
    stays = None
    if use is None:
        stays = members_that_stay(bench, chosen, unknown_columns(bench, left), found.threshold)
    if stays is not None:
        return Judgement(stays, held_out(bench, stays), left, first, chosen, left.failed)
    failed = first if first.failed else first.and_failed(left.failed)
    return Judgement(found.base, found.base_held_out, failed, first, chosen, left.failed, use)


def _better_model(found: Selection) -> Rung | None:
    value = found.gain - sum(found.threshold(i) for i in found.chosen.ids)
    rungs = ladder(found.base_bench, found.base.chi2)
    return better_model(rungs, found.base_bench.forward.model, found.chosen.ids, value)


def beyond_floor(found: Selection, error: HeldOut) -> tuple[str, ...]:
    """Tests that held-out errors fail: the conditions that are predicted worse than instruments and settings allow."""
    off = found.chance.beyond_floor(error)
    return tuple(f"held-out error without {name}, {ratio:.1f} times its floor" for name, ratio in off.items())


def verdict(judgement: Judgement, suspicions: Sequence[Suspicion]) -> Verdict:
    """The verdict, given what stands and what looks wrong in the data."""
    if any(s.severity == "stop" for s in suspicions):
        return Verdict.CANNOT_SAY
    failed = bool(judgement.left.failed) or judgement.use_model is not None
    if not judgement.named.ids:
        return Verdict.NONE_KNOWN if failed else Verdict.ADEQUATE
    return Verdict.PARTLY if failed else Verdict.EXPLAINED


def nearest_words(judgement: Judgement) -> tuple[str, str] | None:
    """What comes nearest, and why it is not the answer."""
    if judgement.use_model is not None:
        words = f"this model explains a chi2 of {judgement.use_model.gain:.0f} more with nothing added"
        return f"model={judgement.use_model.model}", words
    return (listed(judgement.nearest.ids), judgement.why) if judgement.nearest is not None else None


def damage(suspicions: Sequence[Suspicion]) -> str:
    """The gravest of what looks wrong in the data, in a sentence; empty when nothing does."""
    return min(suspicions, key=lambda s: s.severity != "stop").sentence if suspicions else ""
