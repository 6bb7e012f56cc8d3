"""The closed loop: a law put into the march as an effect and fitted with all that was chosen, from its linear sizes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.plausibility import has_diverged
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.readings.forward import Forward
from belt_sim.discovery.search import WITHIN, Scored, cost, fitted
from belt_sim.discovery.survey import Survey
from belt_sim.effects.generic_law import GenericLaw, law_effect
from belt_sim.effects.law_terms import SizedLaw
from belt_sim.jax_setup import map_in_threads

ROUND = 2.0  # sigma
FURTHEST = 10.0  # times the largest reading: a belt that a march takes further has run away
HALVINGS = 20  # to a millionth, as good as nothing


@dataclass(frozen=True)
class Refit:
    """A law in closed loop: its effect, its workbench and joint fit, and the chi2 it explains; exponent: of the
    first term with the tension, value and u, as a fit has it that leaves it free."""

    scored: Scored
    effect: type[GenericLaw]
    bench: Workbench
    fit: Fit
    gain: float
    exponent: tuple[float, float]

    @property
    def worth(self) -> float:
        """chi2 that the law explains in the march, its numbers paid."""
        return self.gain - cost(self.scored.law)

    def estimates(self) -> dict[str, tuple[float, float, str]]:
        """Parameter -> value, u (one sigma), unit; u is 0 of a number that was held."""
        forward, cls = self.bench.forward, self.effect
        covariance = self.fit.covariance
        found = {}
        for position in forward.index(cls.id):
            slot = forward.slots[position]
            free = position in self.fit.free
            u = float(np.sqrt(covariance[k, k])) if free and (k := self.fit.free.index(position)) >= 0 else 0.0
            value = float(self.fit.vector[position]) * slot.scale
            found[slot.name] = (value, u * abs(slot.scale), cls.parameters[slot.name].unit)
        return found

    @property
    def fitted_effect(self) -> GenericLaw:
        """The effect with the numbers that it has in the march."""
        return self.effect(**{name: value for name, (value, _, _) in self.estimates().items()})

    def certain(self, sigmas: float) -> bool:
        """Whether the size of every term lies that far from zero, its knee being where it is; of a wave, its two sizes
        together. Of what is beyond its knee nearly always, readings know size times knee and none of the two.
        """
        squares = dict[str, float]()
        for n in self.effect.numbers:
            if not n.modifier:
                tag = n.name.partition("_")[2]
                value, u = self._beside(n.name, f"knee_{tag}" if tag else "knee")
                squares[tag] = squares.get(tag, 0.0) + (value / u) ** 2 if u > 0.0 else np.inf
        return min(squares.values()) >= sigmas**2

    def limit(self, tag: str) -> tuple[float, float]:
        """Size times knee of a term, and its u: what it comes to beyond its knee."""
        forward, free = self.bench.forward, self.fit.free
        at = [next(p for p in forward.index(self.effect.id) if forward.slots[p].name == f"{n}{tag}")
              for n in ("size", "knee")]  # fmt: skip
        size, knee = (float(self.fit.vector[p]) * forward.slots[p].scale for p in at)
        slope = np.zeros(len(free))
        for p, other in zip(at, (knee, size), strict=True):
            if p in free:
                slope[free.index(p)] = other * forward.slots[p].scale
        return size * knee, float(np.sqrt(max(slope @ self.fit.covariance @ slope, 0.0)))

    def _beside(self, name: str, other: str) -> tuple[float, float]:
        """A number and its u, in units of its scale, another number being what it is."""
        forward, free, covariance = self.bench.forward, self.fit.free, self.fit.covariance
        at = {forward.slots[p].name: p for p in forward.index(self.effect.id)}
        if at[name] not in free:
            return float(self.fit.vector[at[name]]), 0.0
        k = free.index(at[name])
        square = float(covariance[k, k])
        if at.get(other) in free:
            j = free.index(at[other])
            square -= float(covariance[k, j]) ** 2 / float(covariance[j, j])
        return float(self.fit.vector[at[name]]), float(np.sqrt(max(square, 0.0)))


def refits(survey: Survey, laws: Sequence[Scored]) -> list[Refit | None]:
    """Laws in closed loop, side by side: what compiles, loads or marches a few rows leaves a core idle."""
    if len(laws) < 2:
        return [refit(survey, s) for s in laws]
    return map_in_threads(lambda s: refit(survey, s), laws)


def refit(survey: Survey, scored: Scored) -> Refit | None:
    """Fit a law in closed loop; None where the belt of the march runs away with it, however small it is."""
    sizes = fitted(survey, survey.columns(scored.law))[1] if scored.sizes is None else np.array(scored.sizes)
    effect = law_effect(SizedLaw(scored.law, tuple(float(s) for s in sizes), survey.tension))
    old = survey.bench.forward
    chosen = [c for c in old.classes if c.id in survey.fit.ids]
    forward = Forward(survey.bench.samples, old.model, [*chosen, effect], old.step, old.terms, brief=True)
    bench = replace(survey.bench, forward=forward)
    vector, free, own = forward.null(), [], []
    for cls in chosen:
        for new, before in zip(forward.index(cls.id), old.index(cls.id), strict=True):
            vector[new] = survey.fit.vector[before]
            free += [new] if before in survey.fit.free else []
    names = [forward.slots[k].name for k in forward.index(effect.id)]
    for number in effect.numbers:
        position = forward.index(effect.id)[names.index(number.name)]
        vector[position] = number.value / forward.slots[position].scale
        own += [] if number.modifier else [position]
        if not (number.name.startswith("exponent") and len(np.unique(survey.stated_tension)) == 1):
            free.append(position)
    ids = (*[c.id for c in chosen], effect.id)
    start = _on_its_pulleys(bench, vector, own)
    if start is None:
        return None
    moved = bench.moved_to(start).at_levels(survey.bench.levels)
    made = _fitted(survey, scored, effect, moved, Fit(ids=ids, free=free, vector=start))
    return None if made is None else _held(survey, made)


def _fitted(survey: Survey, scored: Scored, effect: type[GenericLaw], bench: Workbench, start: Fit) -> Refit | None:
    fit = bench.fit([start])[0]
    if has_diverged(fit):
        return None
    left = float(survey.bench.metric.chi2(survey.bench.fitted.y - fit.values))
    made = Refit(scored, effect, bench, fit, survey.fit.chi2 - min(left, fit.chi2), (0.0, 0.0))
    return replace(made, exponent=made.estimates()["exponent"][:2])


def _held(survey: Survey, free: Refit) -> Refit:
    """The law with those exponents of the tension held that its readings cannot tell from the round ones of the search,
    or else from the nearest whole number.

    A number that says nothing costs much where a tension was left out: what is left may not know it at all.
    """
    numbers, forward = free.estimates(), free.bench.forward
    positions = dict(zip((forward.slots[k].name for k in forward.index(free.effect.id)),
                         forward.index(free.effect.id), strict=True))  # fmt: skip
    vector, held = free.fit.vector.copy(), set()
    for n in free.effect.numbers:
        round_one = _round(*numbers[n.name][:2], n.value) if n.name.startswith("exponent") else None
        if round_one is not None:
            vector[positions[n.name]] = round_one / forward.slots[positions[n.name]].scale
            held.add(positions[n.name])
    if not held:
        return free
    start = Fit(ids=free.fit.ids, free=[p for p in free.fit.free if p not in held], vector=vector)
    made = _fitted(survey, free.scored, free.effect, free.bench, start)
    return free if made is None or made.gain < free.gain - WITHIN else replace(made, exponent=free.exponent)


def _round(value: float, u: float, searched: float) -> float | None:
    """The exponent of the search, or else the nearest whole one, that a fitted one cannot be told from."""
    return next((n for n in (searched, float(np.round(value))) if abs(value - n) < ROUND * u), None)


def _on_its_pulleys(bench: Workbench, vector: np.ndarray, sizes: list[int]) -> np.ndarray | None:
    """``vector`` with the law's ``sizes`` halved until the march's belt goes no further than some times the real one.

    The sizes are those of the linear range; a law that feeds back on itself may run away in the march. None where it
    does so without the law.
    """
    furthest = FURTHEST * float(np.nanmax(np.abs(bench.fitted.y)))
    points = np.repeat(vector[None], HALVINGS + 1, axis=0)
    points[:, sizes] *= 0.5 ** np.arange(HALVINGS + 1.0)[:, None]
    for point in points:
        if float(np.max(np.abs(bench.forward.values(point[None])))) < furthest:  # nan is no less
            return point
    return None
