"""The admission test of a user's own effect: null limit, declarations, parity, exponent, collinearity."""

import os
from dataclasses import replace

import jax
import numpy as np

from belt_sim.campaign import Campaign, case_of
from belt_sim.case import Case
from belt_sim.curves import late_rates
from belt_sim.diagnosis.fit import basis
from belt_sim.diagnosis.linearisation import linearise_effects
from belt_sim.diagnosis.workbench import workbench
from belt_sim.effects.base import Effect, library
from belt_sim.errors import InputError
from belt_sim.jax_setup import UNFUSED
from belt_sim.line.hooks import call_hook, indicate
from belt_sim.line.march import march_case
from belt_sim.line.spans import Composition
from belt_sim.scene_parts import SceneParts

TRIED_TRAVEL = 40.0  # [m]
ROUNDING = 1e-13  # share of a curve's largest value that null parameters may change where JAX fuses
PARITY = 0.05  # share of the contribution that may have the other parity: run-up nonlinearities are smaller
EXPONENT = 0.2  # late rates follow a power law only in the limit of high tension
# collinearity from which an effect can imitate another in these readings, not always the other way round
IMITATES = 0.98
VISIBLE_LENGTH = 0.1  # whitened length of a shape that can be seen at all
IMITATED_SHOWN = 3
HIGH_TENSION = (4e8, 8e8)  # [Pa]


def admit(cls: type[Effect], model: Composition, campaign: Campaign) -> list[str]:
    """Test one effect on a campaign's machine; returns what passed, in words.

    Raises InputError naming the first thing that is wrong.
    """
    case = case_of(campaign, campaign.runs[0])
    for name, p in cls.parameters.items():
        where = f"{cls.id}.parameters.{name}"
        if not p.unit or not p.meaning:
            raise InputError(where, p, "", "state its unit ('1' for none) and its meaning")
        if not p.plausible[0] < p.plausible[1]:
            raise InputError(f"{where}.plausible", p.plausible, p.unit, "give (low, high)")
        if not np.isfinite(p.scale) or p.scale == 0:
            raise InputError(f"{where}.scale", p.scale, p.unit, "give a size that matters on a real machine")
    # march, readings and scene must be the same to the last bit; where JAX fuses (see jax_setup), an effect that is
    # compiled in changes the rounding of a march, by some 1e-15 of a curve's largest value
    without, null = march_case(case, model, travel=TRIED_TRAVEL), cls.null()
    within = march_case(case, model, (null,), travel=TRIED_TRAVEL)
    read = [indicate(without, case, effects, without.travel) for effects in ((), (null,))]
    exact = UNFUSED in os.environ.get("XLA_FLAGS", "")
    pairs = [pair for two in ((without, within), read) for pair in zip(*map(jax.tree.leaves, two), strict=True)]
    parts = SceneParts.from_case(case)

    def alike(a, b):
        near = not exact and np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=0.0, atol=ROUNDING * np.abs(a).max())
        return near or np.array_equal(a, b)

    if not all(alike(a, b) for a, b in pairs) or call_hook(null, "scene", parts, case) != parts:
        raise InputError(f"{cls.id}.null()", "changes the curves", "", "every hook must return its input when null")
    lines = [f"{cls.id}: null parameters change nothing, {'bit for bit' if exact else 'to rounding'}; units declared"]
    lines += _check_declarations(cls, model, case)

    # the largest cosine between its shapes and those of each effect of the library, beside the nuisances: one that has
    # more shapes can imitate yours, and still not be imitated by it: the evidence tells them apart
    others = [c for c in library().values() if model.refusal(c) is None and c is not cls]
    bench = workbench(campaign, model, [cls, *others])
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    ids = [cls.id, *(c.id for c in others)]
    linearisation = linearise_effects(bench, base, ids)
    shapes = {i: bench.metric.whiten(linearisation.shapes_of(bench, i)) for i in ids}
    bases = {i: basis(rows[np.linalg.norm(rows, axis=1) > VISIBLE_LENGTH]) for i, rows in shapes.items()}
    own = bases.pop(cls.id)
    if not len(own):
        raise InputError(cls.id, "no change", "", "at its scale these readings cannot see it; give a larger scale")
    cosines = {i: float(np.linalg.norm(b @ own.T, ord=2)) for i, b in bases.items() if len(b)}
    for i in sorted(cosines, key=lambda i: -cosines[i])[:IMITATED_SHOWN]:
        told = f": {i} can imitate yours" if cosines[i] > IMITATES else ""
        lines.append(f"{cls.id}: collinearity {cosines[i]:.4f} with {i}{told}")
    return lines


def _contribution(cls: type[Effect], model: Composition, case: Case) -> np.ndarray:
    """What the effect at its scale adds to y at points 1-4 as a sensor reads it, shape (4, n)."""
    at_scale = cls(**{n: p.scale for n, p in cls.parameters.items()})
    curves = march_case(case, model, (at_scale,), travel=TRIED_TRAVEL)
    return (
        np.asarray(indicate(curves, case, (at_scale,), curves.travel).y)
        - march_case(case, model, travel=TRIED_TRAVEL).y
    )


def _check_declarations(cls: type[Effect], model: Composition, case: Case) -> list[str]:
    """Parity in yaw and exponent of tension, as far as they are declared."""
    if cls.parity not in ("odd", "even", "mixed"):
        raise InputError(f"{cls.id}.parity", cls.parity, "", "use odd, even or mixed")
    lines = [f"{cls.id}: parity not declared (mixed)"] if cls.parity == "mixed" else []
    if not lines:
        mirrored = replace(case.settings, yaw=replace(case.settings.yaw, change=-case.settings.yaw.change))
        here = _contribution(cls, model, case)
        there = _contribution(cls, model, replace(case, settings=mirrored))
        if not np.abs(here).max() > 0:
            remedy = "at its scale it moves nothing on this machine; give a larger scale"
            raise InputError(cls.id, "no change", "", remedy)
        sign = -1.0 if cls.parity == "odd" else 1.0
        off = np.linalg.norm(there - sign * here) / np.linalg.norm(np.stack([here, there]))
        if off > PARITY:
            raise InputError(f"{cls.id}.parity", cls.parity, "", f"measured: {off:.0%} of it has the other parity")
        lines.append(f"{cls.id}: {cls.parity} in yaw, as declared ({off:.1%} off)")
    if cls.tension_exponent is None:
        return lines
    sizes = []
    for tension in HIGH_TENSION:
        tight = replace(case, settings=replace(case.settings, tension=tension))
        curves = march_case(tight, model, travel=TRIED_TRAVEL)
        rates = late_rates(replace(curves, y=_contribution(cls, model, tight)))
        sizes.append(float(np.linalg.norm(rates)))
    measured = np.log(max(sizes[1], 1e-300) / max(sizes[0], 1e-300)) / np.log(HIGH_TENSION[1] / HIGH_TENSION[0])
    if abs(measured - cls.tension_exponent) > EXPONENT:
        raise InputError(f"{cls.id}.tension_exponent", cls.tension_exponent, "", f"measured {measured:.2f}")
    return [*lines, f"{cls.id}: late rate ~ tension^{measured:.2f}, declared {cls.tension_exponent:g}"]
