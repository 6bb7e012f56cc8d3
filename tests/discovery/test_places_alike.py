"""The places at which something may act as well: by the noise, from the angle between responses and from evidence."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from small_discovery import discovered, surveyed

from belt_sim.discovery.linear_search import ScoredLaw, exponents_of, unexplained_elsewhere
from belt_sim.discovery.selection import MODELLED, WITHIN, SearchOutcome
from belt_sim.discovery.words import describe_discovery
from belt_sim.effects.law import Form, Law, Place, Term


def law_at(data, name, **form):
    return Law((Term(next(p for p in data.places if p.name == name), Form("none", **form)),))


def test_what_is_left_elsewhere_is_the_squared_sine_of_the_angle_between_responses():
    """By dense least squares over every form of one other place, nuisances beside it."""
    data = surveyed("torsion_creep")
    law = law_at(data, "torsion_both", course="linear")
    columns = data.columns(law)
    size = data.projector.fit_sizes(columns)[1]
    made = np.tensordot(size, columns, axes=1).ravel()
    shared = data.projector.shared.reshape(len(data.projector.shared), -1)
    prior = np.sqrt(data.projector.prior)
    left = {}
    wide = replace(data, wide=True)
    for place in (p for p in data.places if p.name == "bending_both"):
        best = np.inf
        for form in (f for some in wide.forms(place) for f in some):
            halves = list(form.halves.values())
            for n in exponents_of(data):
                own = (data.rows(place, halves) * data.weight(n)[None, :, None]).reshape(len(halves), -1)
                if not np.isfinite(own).all() or not own.any():
                    continue
                rows = np.concatenate([own / np.linalg.norm(own, axis=1).max(), shared]).T
                rows = np.concatenate([rows, np.diag([*[0.0] * len(own), *prior])])
                aim = np.concatenate([made, np.zeros(rows.shape[1])])
                best = min(best, float(np.sum((aim - rows @ np.linalg.lstsq(rows, aim, rcond=None)[0]) ** 2)))
        left[place.name] = best
    found = {place.name: x for place, x in unexplained_elsewhere(wide, law).items()}
    assert "torsion_both" not in found
    for name, x in left.items():
        assert abs(found[name] - x) < 0.02 * x + 0.5


def test_places_are_alike_by_the_noise():
    """A torsion that creeps is told from all else at 25 sigma, at a fifth of that not from a change of tension."""
    data = surveyed("torsion_creep")
    law = law_at(data, "torsion_both", course="linear")
    alike = []
    for share in (1.0, 0.2):
        faint = replace(data, projector=replace(data.projector, residual=share * data.projector.residual), kept={})
        gain = faint.projector.fit_sizes(faint.columns(law))[0]
        told: Any = SimpleNamespace(scored=ScoredLaw(law, gain, 0.0))
        found = SearchOutcome(data=faint, latent_inputs=(), choice=told, best=told).alike
        alike.append([p.name for p in found])
        left = {p.name: x for p, x in unexplained_elsewhere(replace(faint, wide=True), law).items()}
        assert (left["tension"] < WITHIN + MODELLED * gain) == ("tension" in alike[-1])
    assert alike[0] == []
    assert "tension" in alike[1]
    assert "torsion_both" not in alike[1]


def test_places_alike_are_in_the_result_and_its_sentence(monkeypatch):
    monkeypatch.setattr(SearchOutcome, "alike", (Place("tension"), Place("yaw", "head")))
    found = describe_discovery(discovered("yaw_creep"), 1.0)
    assert found.alike == ("tension of the belt", "yaw of the head pulley")
    assert found.sentence.endswith(
        " These runs cannot say where it acts: 2 other places fit alike: "
        "the tension of the belt and the yaw of the head pulley."
    )
    assert "looks like" not in found.sentence  # no cause at a place that is open
    assert repr(found).startswith("Something is missing")
