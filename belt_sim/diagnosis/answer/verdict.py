"""From what was chosen and what it leaves to what is found: a set is found only if nothing is left with it."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.campaign import Suspicion
from belt_sim.diagnosis.answer.confusable import probabilities
from belt_sim.diagnosis.answer.ladder import Rung, better_model, ladder
from belt_sim.diagnosis.choice.beside_a_law import needed_beside_laws, only, refused, stands
from belt_sim.diagnosis.choice.occam import imitated, outdone
from belt_sim.diagnosis.choice.rise import rises
from belt_sim.diagnosis.choice.select import Selection
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import HeldOut, held_out
from belt_sim.diagnosis.left_over.beside import members_that_stay, unknown_columns
from belt_sim.diagnosis.left_over.openset import OpenSet, open_set
from belt_sim.diagnosis.left_over.unknown import Look, Unknown
from belt_sim.results.verdict import Verdict
from belt_sim.results.words import listed

SHOWN = 3  # failed tests in a sentence
IMPROBABLE = 0.05  # probability, below which nothing is named beside an unknown


@dataclass(frozen=True)
class Judgement:
    """What stands after the tests.

    named: the fit of the effects that are found, the base fit when none is; left: the tests of what the named leave;
    base_left: the same of the base model; nearest: the set that explains most but not all, and the tests that it fails;
    use_model: another base model that explains more; unknown: what is seen beside the named effects, if anybody looked;
    instead: the selection of the named effects, where it is another than was made.
    """

    named: Fit
    named_held_out: HeldOut
    left: OpenSet
    base_left: OpenSet
    nearest: Fit | None = None
    fails: tuple[str, ...] = ()
    use_model: Rung | None = None
    unknown: Unknown | None = None
    instead: Selection | None = None

    @property
    def why(self) -> str:
        """Why the nearest known set is not the answer."""
        more = f" and {len(self.fails) - SHOWN} more" if len(self.fails) > SHOWN else ""
        return f"with it these tests still fail: {', '.join(self.fails[:SHOWN])}{more}" if self.fails else ""


def judged(found: Selection, *, bootstraps: int, seed: int, look: Look | None = None) -> Judgement:
    """What of the chosen set stands; where none was chosen and something is left, what hold-out refused because of that
    something.
    """
    made = _judged(found, bootstraps=bootstraps, seed=seed, look=look)
    if look is None or made.unknown is None or made.named.ids or not made.left.failed:
        return made
    trial = refused(found, made.left, made.unknown)
    if trial is None:
        return made
    other = found.instead((trial.id,))
    left = open_set(other.bench, other.chosen, bootstraps=bootstraps, seed=seed)
    unknown = look(other.bench, other.chosen, True)
    return _beside_a_law(other, made, left.and_failed(unknown.failed), unknown, look) or made


def _beside_a_law(other: Selection, made: Judgement, left: OpenSet, unknown: Unknown, look: Look) -> Judgement | None:
    """The judgement that names what hold-out had refused; None where that does not stand beside the unknown."""
    if made.unknown is None or not left.failed:
        return None
    columns = np.concatenate([made.unknown.columns(), _columns(other, left, unknown)])
    stays = members_that_stay(other.bench, other.chosen, columns, other.threshold)
    if stays is None or min(probabilities(other, made.base_left)[i] for i in stays.ids) < IMPROBABLE:
        return None
    if not stands(other, stays, look):
        return None
    held = held_out(other.bench, stays)
    return Judgement(stays, held, left, made.base_left, other.chosen, left.failed, unknown=unknown, instead=other)


def _judged(found: Selection, *, bootstraps: int, seed: int, look: Look | None) -> Judgement:
    """Test what the chosen set leaves; where that fails, keep only what is needed beside the unknown.

    The unknown is what is seen beside the chosen set, and what is seen beside the base model: effects that took most of
    it for themselves leave a rest that says little of it.
    """
    if not found.chosen.ids:  # nothing was fitted, so that nothing can fail where it was not
        return _base_alone(found, found.base_left, look)
    if rises := _rises(found, found.held_out):
        bare_model = _base_alone(found, found.base_left, look)
        return bare_model if bare_model.use_model else replace(bare_model, nearest=found.chosen, fails=rises)
    first = found.base_left.and_failed(beyond_floor(found, found.base_held_out))
    with ThreadPoolExecutor(1) as beside:  # other models are marched meanwhile
        testing = beside.submit(open_set, found.bench, found.chosen, bootstraps=bootstraps, seed=seed)
        use = _better_model(found, look)
        left = testing.result().and_failed(beyond_floor(found, found.held_out))
    if use is not None:
        return _base_instead(found, first, left, use)
    unknown, imitating = _asked(found, left, look) if look is not None else (None, ())
    left = left.and_failed(unknown.failed if unknown is not None else ())
    if not left.failed:
        if look is None or not imitating:
            return Judgement(found.chosen, found.held_out, left, first, unknown=unknown)
        bare = look(found.base_bench, found.base, True)
        return replace(_base_instead(found, first, left.and_failed(imitating), None), unknown=bare)
    return _beside_the_unknown(found, first, left, unknown, look)


def _asked(found: Selection, left: OpenSet, look: Look) -> tuple[Unknown, tuple[str, ...]]:
    """What is seen beside the chosen set, and the law that does better than it, which is asked for at the same time
    where no test has failed yet.
    """
    if left.failed:
        return look(found.bench, found.chosen, True), ()
    with ThreadPoolExecutor(1) as beside:
        imitating = beside.submit(imitated, found, look)
        return look(found.bench, found.chosen, False), imitating.result()


def _beside_the_unknown(
    found: Selection, first: OpenSet, left: OpenSet, unknown: Unknown | None, look: Look | None
) -> Judgement:
    """Something is left beside the chosen set: what of it is needed beside that."""
    with ThreadPoolExecutor(1) as beside:  # what is seen beside the base model is asked for in any case
        seen = beside.submit(_bare, found, look)
        columns = _columns(found, left, unknown)
        stays = _needed(found, found.chosen, columns)
        bare = seen.result()
    if stays is not None and bare is not None:
        stays = _needed(found, found.chosen, np.concatenate([bare.columns(), columns]))
    if stays is None or min(probabilities(found, first)[i] for i in stays.ids) < IMPROBABLE:
        return replace(_base_instead(found, first, left, None), unknown=bare)
    if look is not None and unknown is not None and bare is not None:
        stays, unknown = _beside_laws(found, stays, unknown, bare, look)
        if stays is None:
            return replace(_base_instead(found, first, left, None), unknown=bare)
    return Judgement(stays, held_out(found.bench, stays), left, first, found.chosen, left.failed, unknown=unknown)


def _bare(found: Selection, look: Look | None) -> Unknown | None:
    """What is seen beside the base model, its law found as well; None where nobody looks."""
    if look is None:
        return None
    bare = look(found.base_bench, found.base, True)
    bare.columns()
    return bare


def _beside_laws(
    found: Selection, stays: Fit, unknown: Unknown, bare: Unknown, look: Look
) -> tuple[Fit | None, Unknown]:
    """What of a set that stays no law does without, and what is seen beside that.

    unknown: what is seen beside the chosen set; bare: beside the base model.
    """
    known, alone = None, found.bench.fit([found.bench.start(stays.ids, stays.vector)])[0]
    while True:
        if alone.ids != found.chosen.ids:
            unknown = look(found.bench, alone, True, known)
        needed = needed_beside_laws(found, alone, unknown, bare, look)
        if needed == alone.ids:
            return stays, unknown
        stays = alone = found.bench.fit([only(found.bench, alone, needed)])[0]
        if not needed or _misleads(found, held_out(found.bench, alone)):
            return None, bare
        known = unknown


def _needed(found: Selection, fit: Fit, columns: np.ndarray) -> Fit | None:
    """What of a fit is needed beside unknown ``columns`` and predicts no worse than the base model does; None where
    nothing is.
    """
    stays = members_that_stay(found.bench, fit, columns, found.threshold)
    if stays is None:
        return None
    worse = _misleads(found, held_out(found.bench, stays))
    chi2 = [float(found.bench.metric.chi2(found.bench.fitted.y - f.values)) for f in (stays, found.base)]
    return None if worse or chi2[0] > chi2[1] else stays


def _misleads(found: Selection, held: HeldOut) -> bool:
    """Whether what is held out is predicted worse than by the base model."""
    return bool(found.chance.rises(held, found.base_held_out) or _rises(found, held))


def _rises(found: Selection, held: HeldOut) -> tuple[str, ...]:
    """The rise of the held-out error beside the base model's, as a failed test."""
    return rises(found.bench, found.base_held_out, found.bare_held_out, held)


def _base_alone(found: Selection, first: OpenSet, look: Look | None) -> Judgement:
    """Nothing was chosen: is the base model adequate?"""
    use = _better_model(found, look) if first.failed else None
    unknown = look(found.base_bench, found.base, bool(first.failed)) if look is not None and use is None else None
    first = first.and_failed(unknown.failed if unknown is not None else ())
    return Judgement(found.base, found.base_held_out, first, first, use_model=use, unknown=unknown)


def _base_instead(found: Selection, first: OpenSet, left: OpenSet, use: Rung | None) -> Judgement:
    """No effect that was chosen can be named."""
    failed = first if first.failed else first.and_failed(left.failed)
    return Judgement(found.base, found.base_held_out, failed, first, found.chosen, left.failed, use)


def _columns(found: Selection, left: OpenSet, unknown: Unknown | None) -> np.ndarray:
    """What else may be there beside the chosen set: anything smooth, and what was discovered."""
    smooth = unknown_columns(found.bench, left)
    columns = unknown.columns() if unknown is not None else smooth[:0]
    return np.concatenate([columns, smooth])


def _better_model(found: Selection, look: Look | None) -> Rung | None:
    value = found.gain - sum(found.threshold(i) for i in found.chosen.ids)
    rungs = ladder(found.base_bench, found.base.chi2)
    use = better_model(rungs, found.base_bench.forward.model, found.chosen.ids, value)
    return None if use is not None and look is not None and outdone(found, use.gain, look) else use


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
