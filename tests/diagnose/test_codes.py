"""Which code takes a derivative: few programs are loaded, and no march pays for an effect that is null in it."""

import numpy as np
from small_campaign import MODEL, campaign

from belt_sim.diagnosis.forward import HEAVY, LIGHT, Forward, Work
from belt_sim.diagnosis.samples import samples_of
from belt_sim.effects.belt_shape import Weld
from belt_sim.effects.pulley_shape import Crown, Taper


def test_what_is_dear_is_asked_by_itself_where_nothing_else_acts(monkeypatch):
    forward = Forward(samples_of(campaign("nothing")), MODEL, (Taper, Crown, Weld))
    sizes = [k for k, s in enumerate(forward.slots) if not s.only_shapes]
    along = np.eye(forward.size)[sizes]
    asked: list[frozenset[str]] = []

    def noted(self, vector, groups):
        """The code is noted, and neither compiled nor run."""
        asked.append(groups)
        return Work(np.zeros((len(vector), *self.samples.y.shape)), [])

    monkeypatch.setattr(Forward, "_march", noted)
    forward.values_and_slopes(np.repeat(forward.null()[None], len(along), axis=0), along)
    assert set(asked) == {frozenset({LIGHT}), frozenset({HEAVY})}
    asked.clear()
    tapered = forward.null()
    tapered[forward.index("taper")] = 0.1
    forward.values_and_slopes(np.repeat(tapered[None], len(along), axis=0), along)
    assert set(asked) == {frozenset({LIGHT}), frozenset({LIGHT, HEAVY})}
