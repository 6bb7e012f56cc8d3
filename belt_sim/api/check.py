"""Checks before a diagnosis: what a campaign, or the plan of one, can tell of a model; whether an effect of one's own
is what it declares (null limit, declarations, parity, exponent, collinearity)."""

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import jax
import numpy as np

from belt_sim.api.simulate import ModelSpec, campaign_model, campaign_of, candidates_of, fitted_model
from belt_sim.campaign import Campaign, Run, case_of
from belt_sim.campaign.folder import is_plan, read_begun, read_plan
from belt_sim.case import Case
from belt_sim.curves import late_rates
from belt_sim.diagnosis.fit import basis
from belt_sim.diagnosis.foresight import find_doubts, free_starts, pairs, visible
from belt_sim.diagnosis.linearisation import linearise_effects
from belt_sim.diagnosis.workbench import linear_response, workbench
from belt_sim.effects.base import Effect, library
from belt_sim.errors import InputError, finite, flag
from belt_sim.io import provenance
from belt_sim.jax_setup import UNFUSED, one_blas_thread
from belt_sim.line.hooks import call_hook, indicate
from belt_sim.line.march import march_case
from belt_sim.line.spans import Composition
from belt_sim.results.errors import CampaignLabel, Check, Doubt
from belt_sim.scene_parts import SceneParts
from belt_sim.settings import BOUNDS

PLANNED_TRAVEL, PLANNED_STEP = 60.0, 0.5  # [m] that a planned run is recorded over, and between its readings
MOST_PLANNED = 10_000  # readings of a planned run


@one_blas_thread
def check(
    campaign: Campaign | str | Path,
    model: ModelSpec | None = None,
    effects: Any = None,
    *,
    travel: float = PLANNED_TRAVEL,
    step: float = PLANNED_STEP,
    advise: bool = True,
    config: Any = None,
) -> Check:
    """What ``campaign`` (an object, or a folder, some or all of whose runs may still be to be measured) can tell.

    model: an analytic one; effects: as in diagnose; travel, step [m]: of the records of planned runs; advise: look for
    the further run that would tell a pair apart. Raises CampaignError with every fault of a folder.
    """
    flag("advise", advise)
    for name, value in (("travel", travel), ("step", step)):
        finite(name, value, "m", "give a length in metres", lambda x: x > 0)
    planned = not isinstance(campaign, Campaign) and is_plan(campaign)
    BOUNDS["travel"].check(travel, name="travel")
    least = travel / MOST_PLANNED
    if not least <= step or (planned and step >= travel / 10.0):
        remedy = f"between readings of planned runs; {least:g} ({MOST_PLANNED} readings a run) to {travel / 10.0:g}"
        raise InputError("step", f"{step:g}", "m", remedy)
    for name, value, usual in (("travel", travel, PLANNED_TRAVEL), ("step", step, PLANNED_STEP)):
        if not planned and value != usual:
            remedy = "is of planned runs; these are measured, with travels of their own: leave it"
            raise InputError(name, value, "m", remedy)
    missing: tuple[Run, ...] = ()
    if isinstance(campaign, Campaign):
        read = campaign
    elif planned:
        read = read_plan(campaign, travel=travel, step=step)
    else:
        read, missing = read_begun(campaign)
    chosen = fitted_model(campaign_model(model, read))
    read, running = (read, ()) if planned else free_starts(read, chosen)
    found = find_doubts(read, chosen, planned=planned, known=running)
    common: dict[str, Any] = {"campaign": CampaignLabel.of(read), "base_model": chosen.name, "planned": planned}
    common |= {"runs": tuple(r.name for r in read.runs), "missing": tuple(r.name for r in missing)}
    common |= {"provenance": provenance(config) | {"data_sha256": read.sha256}}
    if not any(len(r.travel) for r in read.runs) or not any(s.kind == "lateral" for s in read.signals):
        only = Doubt(kind="plan", sentence="there are no curves of a point: belt-sim compare works, diagnose does not")
        return Check(**common, noise="Steady rates only.", doubts=(*found, only), visible=(), pairs=())
    bench, fit = linear_response(read, chosen, candidates_of(effects, chosen), planned=planned)
    seen = visible(bench, fit)
    alike = tuple(pairs(bench, fit, seen, advise=advise))
    return Check(
        **common, noise=bench.levels.sentence, doubts=found, visible=tuple(seen), pairs=alike, machine=bench.machine
    )


# The test of an effect of one's own.

TRIED_TRAVEL = 40.0  # [m]
ROUNDING = 1e-13  # share of a curve's largest value that null parameters may change where JAX fuses
PARITY = 0.05  # share of the contribution that may have the other parity: run-up nonlinearities are smaller
EXPONENT = 0.2  # late rates follow a power law only in the limit of high tension
# collinearity from which an effect can imitate another in these readings, not always the other way round
IMITATES = 0.98
VISIBLE_LENGTH = 0.1  # whitened length of a shape that can be seen at all
IMITATED_SHOWN = 3
HIGH_TENSION = (4e8, 8e8)  # [Pa]


def check_effect(
    effect: type[Effect] | str | Path, model: ModelSpec = "strip", campaign: Campaign | str | Path = "slack_belt"
) -> tuple[str, ...]:
    """What the test of an effect of one's own says, a line each: null limit, parity, exponent, look-alikes.

    effect: a class or a .py file; it is tried on the machine and the runs of ``campaign``. Raises InputError naming the
    first thing that is wrong.
    """
    chosen, read = fitted_model(model), campaign_of(campaign)
    classes = candidates_of([effect if isinstance(effect, type) else str(effect)], chosen)
    return tuple(line for cls in classes for line in admit(cls, chosen, read))


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

    def alike(a: np.ndarray, b: np.ndarray) -> bool:
        near = not exact and np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=0.0, atol=ROUNDING * np.abs(a).max())
        return bool(near) or np.array_equal(a, b)

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
    without = march_case(case, model, travel=TRIED_TRAVEL)
    added: np.ndarray = np.asarray(indicate(curves, case, (at_scale,), curves.travel).y) - np.asarray(without.y)
    return added


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
