"""For how many campaigns is the true place of a changed span distinguishable from every other?

    python -m studies.challenge.places 46400000 40

What the hidden fault does to the readings, by the generator and without noise, is fitted by every law of one term at
every other place, all sizes, knees and lengths free, settings and sheet within their u. Below ``APART`` sigma no method
can tell the places apart; more rivals (two terms, free inputs, other sheets) would only make them fewer.
"""

import sys
from dataclasses import replace

import numpy as np

from belt_sim.api.simulate import fitted_model
from belt_sim.diagnosis.workbench import linear_response
from belt_sim.discovery.closed_loop import fit_closed_loop
from belt_sim.discovery.linear_search import distinct_families, refine_numbers, single_term_laws
from belt_sim.discovery.search_data import search_data_of
from belt_sim.virtual_rig import Truth
from studies.application import show_help
from studies.challenge.oracle import noise_free
from studies.challenge.registry import source
from studies.challenge.report import APART
from studies.challenge.score import SPAN, generator_place

TRIED = 3  # families of laws a place that are fitted in closed loop


def sigma_from_others(seed: int, name: str = "plant_span") -> tuple[Truth, float, dict[str, float]]:
    """The truth of a campaign, how far its hidden span acts on the readings [sigma], and what laws at each other place
    leave of that [sigma]."""
    campaign, truth = source(name)(seed)
    known = replace(truth, effects=[e for e in truth.effects if e["id"] == "edge_profile"])
    with_it, without = (noise_free(campaign, t) for t in (truth, known))
    bench, fit = linear_response(campaign, fitted_model(truth.base), (), planned=False)
    change = [
        [a.signals[s.name] - b.signals[s.name] for s in bench.samples.signals]
        for a, b in zip(with_it.runs, without.runs, strict=True)
    ]
    data = replace(search_data_of(bench, fit), wide=True)
    white = np.nan_to_num(data.projector.whiten(np.array(change)[None])[0])
    data = replace(data, projector=replace(data.projector, residual=white))
    whole, own = data.projector.chi2(), {truth.place} | (SPAN if truth.place == "span" else set())
    left: dict[str, float] = {}
    for place in data.places:
        there = generator_place(place.name)
        if there in own:
            continue
        for law in distinct_families(single_term_laws(replace(data, places=(place,))), TRIED):
            fine = refine_numbers(data, law.law)
            made = fit_closed_loop(data, fine, data.projector.fit_sizes(data.columns(fine))[1])
            if made is not None:
                left[there] = min(left.get(there, np.inf), max(whole - made.gain, 0.0))
    return truth, float(whole**0.5), {p: float(x**0.5) for p, x in sorted(left.items(), key=lambda one: one[1])}


if __name__ == "__main__":
    show_help(__doc__)
    first, count = map(int, sys.argv[1:3])
    apart = 0
    for seed in range(first, first + count):
        truth, size, left = sigma_from_others(seed)
        apart += min(left.values()) >= APART
        near = ", ".join(f"{p} {x:.1f}" for p, x in list(left.items())[:3])
        print(f"{seed} {truth.effects[0]['id']:16} {truth.place:13} {size:7.1f} sigma; left: {near}", flush=True)
    print(f"distinguishable from every other place at {APART:g} sigma: {apart} of {count}")
