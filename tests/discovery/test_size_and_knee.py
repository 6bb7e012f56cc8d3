"""A law that is beyond its knee nearly always: the readings know size times knee, and neither of the two."""

from types import SimpleNamespace

import numpy as np
from small_discovery import surveyed

from belt_sim.discovery.linear_search import ScoredLaw
from belt_sim.discovery.selection import MarchFit
from belt_sim.effects.law import Form, Law, Term

SIZE, KNEE, U = -1.6, 2e-6, 0.02


def fitted(apart: float, product: float = U) -> MarchFit:
    """Their product is known to ``product`` of it, and what moves them against each other to ``apart``."""
    turned = np.array([[1.0, 1.0], [1.0, -1.0]]) / 2.0
    slots = [SimpleNamespace(name=n, scale=abs(v)) for n, v in (("size", SIZE), ("knee", KNEE))]
    forward = SimpleNamespace(slots=slots, index=lambda name: range(2))
    parameters = {n: SimpleNamespace(unit=unit) for n, unit in (("size", "1"), ("knee", "1/m"))}
    cls = SimpleNamespace(id="generic_law", parameters=parameters)
    covariance = turned.T @ np.diag([apart**2, product**2]) @ turned
    columns = np.linalg.cholesky(np.linalg.inv(covariance))
    fit = SimpleNamespace(vector=np.array([-1.0, 1.0]), free=[0, 1], covariance=covariance, columns=columns)
    place = next(p for p in surveyed("yaw_creep").places if p.name == "turn_both")
    law = Law((Term(place, Form("kappa", shape="saturation", knee=KNEE)),))
    return MarchFit(ScoredLaw(law, 400.0, 397.0), cls, SimpleNamespace(forward=forward), fit, 400.0, (0.0, 0.0))


def test_a_size_that_is_known_with_its_knee_is_certain():
    """Size over its u is 1 by itself, and with the knee held far more; where the knee says nothing of it, it is not."""
    unknown = fitted(apart=2.0)
    assert unknown.estimates()["size"][1] > 0.9 * abs(SIZE)
    assert unknown.sizes_are_certain(2.0)
    assert not fitted(apart=2.0, product=2.0).sizes_are_certain(2.0)
