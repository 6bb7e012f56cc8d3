"""What a comparison or a diagnosis has to draw, in the units people read: overlays, maps, drift charts."""

from itertools import product

import numpy as np

from belt_sim.campaign import Campaign, case_of
from belt_sim.diagnosis.errors import WINDOWS, K, error_map, validation_uncertainty
from belt_sim.diagnosis.fit import fit_sets
from belt_sim.diagnosis.noise import metric_of
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.jax_setup import map_in_threads
from belt_sim.results.errors import UNIT_OF_KIND, CampaignLabel, Drawings, Drift, FailureMap, Panel
from belt_sim.results.estimates import MachineSizes
from belt_sim.results.words import KILO
from belt_sim.units import DEGREE, N_PER_MM2


def label(campaign: Campaign) -> CampaignLabel:
    """Which campaign it was."""
    return CampaignLabel(title=campaign.title, sha256=campaign.sha256, source=campaign.source.kind)


def overlays(bench: Workbench, base: np.ndarray, final: np.ndarray | None) -> tuple[Panel, ...]:
    """One panel a run and signal; base and final (R, S, n) are predictions before and after."""
    band = K * validation_uncertainty(bench)
    panels = []
    for r, run in enumerate(bench.samples.runs):
        for s, signal in enumerate(bench.samples.signals):
            keep = np.isfinite(bench.samples.y[r, s])
            if not keep.any():
                continue
            title = f"{run.name} {signal.name}, {run.tension / N_PER_MM2:g} N/mm², {run.yaw / DEGREE:+.3g}°"
            panels.append(
                Panel(
                    run=run.name,
                    title=title + ("" if run.use == "fit" else ", held out"),
                    travel=bench.samples.travel[r][keep],
                    measured=bench.samples.y[r, s][keep] * KILO,
                    base=base[r, s][keep] * KILO,
                    band=band[r, s][keep] * KILO,
                    final=None if final is None else final[r, s][keep] * KILO,
                    unit=UNIT_OF_KIND[signal.kind],
                )
            )
    return tuple(panels)


#: Tensions that a map or a chart tells apart.
MOST_LEVELS = 12


def tension_levels(tension: np.ndarray) -> np.ndarray:
    """Tension (n,) that each is drawn at: its own, or of more than MOST_LEVELS the mean of those close to it."""
    if len(np.unique(tension)) <= MOST_LEVELS:
        return tension
    edges = np.geomspace(tension.min(), tension.max(), MOST_LEVELS + 1)[1:-1]
    level = np.searchsorted(edges, tension)
    number = np.maximum(np.bincount(level), 1)
    return (np.bincount(level, weights=tension) / number)[level]


Predicted = tuple[Workbench, np.ndarray, np.ndarray]


def drawings(base: Predicted, final: Predicted | None, *, mapped: np.ndarray) -> Drawings:
    """base, final: a workbench, a parameter vector and its predictions (R, S, n), before and after; mapped: predictions
    that the maps judge, E/u_val over tension and travel windows, one map a signal and yaw sign.
    """
    bench = base[0]
    found, runs, maps = error_map(bench, mapped), bench.samples.runs, []
    there, level = np.isfinite(found.rms), np.full(found.rms.shape, np.nan)
    level[there] = tension_levels(np.array([runs[r].tension / N_PER_MM2 for r in np.nonzero(there)[0]]))
    signs, ways = np.sign([run.yaw for run in runs]), ((1, "yaw > 0"), (-1, "yaw < 0"), (0, "yaw = 0"))
    for (s, signal), (sign, name) in product(enumerate(bench.samples.signals), ways):
        own = there[:, s] & (signs == sign)[:, None]
        tensions = np.unique(level[:, s][own])
        if not len(tensions):
            continue
        worst = np.full((len(tensions), WINDOWS), np.nan)
        for r, w in np.argwhere(own):
            row = np.searchsorted(tensions, level[r, s, w])
            if not abs(worst[row, w]) > abs(found.ratio[r, s, w]):  # of repeated runs
                worst[row, w] = found.ratio[r, s, w]
        maps.append(FailureMap(title=f"{signal.name}, {name}", tension=tensions, edges=found.edges, ratio=worst))
    before, after = stiffness_drift(*base[:2]), stiffness_drift(*final[:2]) if final else None
    return Drawings(
        overlays=overlays(bench, base[2], final[2] if final else None),
        maps=tuple(maps),
        drifts=((before, after),) if before is not None else (),
        machine=machine_of(bench),
    )


def machine_of(bench: Workbench) -> MachineSizes:
    """The sizes of the machine in which people read numbers of effects."""
    case = case_of(bench.campaign, bench.samples.runs[0])
    rig = {n: float(getattr(case.rig, n)) for n in ("centre_distance", "tail_radius", "head_radius", "span_length")}
    return MachineSizes(width=float(case.belt.width), **rig)


GPA = 1e9
LIMIT = 3.0  # a model that asks for more than three times the stated value, or less than a third, is shown there


def stiffness_drift(bench: Workbench, vector: np.ndarray) -> Drift | None:
    """Young's modulus [GPa] that each level of tension asks for by itself; None with fewer than two tensions.

    Only F/EI enters a beam: a wrong tension, width or thickness shows here as well.
    """
    stress = tension_levels(np.array([r.tension for r in bench.samples.runs]))
    tensions = np.unique(stress)
    if len(tensions) < 2 or not bench.forward.model.moments:
        return None
    stated = bench.campaign.belt.youngs_modulus
    position = len(bench.forward.slots)

    def fitted(t: float) -> tuple[float, float]:
        which = np.flatnonzero(stress == t)
        own = bench.fitted.of_runs(which)
        metric = metric_of(own, bench.levels, bench.shapes[:, which], 0.0 * bench.shared[:, which])
        fit = fit_sets(bench.forward.of_runs(which), metric, [bench.start((), vector, free=[position])])[0]
        factor = np.clip(1.0 + fit.vector[position], 1.0 / LIMIT, LIMIT)
        beyond = factor in (1.0 / LIMIT, LIMIT)  # no interval is drawn about a value off the chart
        return factor, 0.0 if beyond else min(np.sqrt(fit.covariance[0, 0]), 0.5 * factor)

    # marches of a few rows leave a core idle
    value, u = (np.array(map_in_threads(fitted, tensions)) * stated.value / GPA).T
    return Drift(
        parameter="Young's modulus",
        unit="GPa",
        tension=tensions / N_PER_MM2,
        value=value,
        u=u,
        stated=stated.value / GPA,
        u_stated=stated.u / GPA,
    )
