"""Which code takes a derivative: few programs are loaded, and no march pays for an effect that is null in it."""

import numpy as np
from small_campaign import MODEL, campaign

from belt_sim.diagnosis import forward as forward_module
from belt_sim.diagnosis.forward import HEAVY, Forward, Work
from belt_sim.diagnosis.samples import samples_of
from belt_sim.effects.belt_shape import Camber, Weld
from belt_sim.effects.pulley_shape import Crown, Taper
from belt_sim.effects.yaw import YawOffsetTail


def test_what_is_dear_is_asked_by_itself_where_nothing_else_acts(monkeypatch):
    forward = Forward(samples_of(campaign("nothing")), MODEL, (Taper, Crown, Weld))
    sizes = [k for k, s in enumerate(forward.slots) if not s.parameter.modifier]
    along = np.eye(forward.size)[sizes]
    asked: list[frozenset[str]] = []

    def noted(self, vector, groups):
        """The code is noted, and neither compiled nor run."""
        asked.append(groups)
        return Work(np.zeros((len(vector), *self.samples.y.shape)), [])

    monkeypatch.setattr(Forward, "_march", noted)
    forward.values_and_slopes(np.repeat(forward.null()[None], len(along), axis=0), along)
    assert set(asked) == {frozenset(), frozenset({HEAVY})}
    asked.clear()
    tapered = forward.null()
    tapered[forward.index("taper")] = 0.1
    forward.values_and_slopes(np.repeat(tapered[None], len(along), axis=0), along)
    assert set(asked) == {frozenset(), frozenset({HEAVY})}


def test_an_effect_that_is_null_takes_no_time_and_changes_no_bit(monkeypatch):
    """A batch passes over the hooks of effects that are null in all of its rows (``switched``)."""
    classes = (Taper, Crown, YawOffsetTail, Camber)
    passed: list[int] = []
    compile_march = forward_module.compile_march

    def noting(*arguments):
        program = compile_march(*arguments)
        return lambda *given: (passed.append(int(given[-1].sum())), program(*given))[1]

    monkeypatch.setattr(forward_module, "compile_march", noting)

    def predict():
        forward = Forward(samples_of(campaign("nothing")), MODEL, classes)
        points = np.repeat(forward.null()[None], 3, axis=0)
        points[1, forward.index("taper")] = 0.1
        points[2, [*forward.index("crown"), *forward.index("camber")]] = 0.1
        return np.concatenate([forward._predict(points[k : k + 1], [frozenset()]) for k in range(3)])

    found = predict()
    assert passed == [0, 1, 2]
    monkeypatch.setattr(forward_module, "switched", lambda effect, acts: effect)
    compile_march.cache_clear()
    monkeypatch.setenv("BELT_SIM_CACHE", "off")
    monkeypatch.setattr(forward_module, "program_key", lambda *parts: None)
    assert np.array_equal(found, predict())
    compile_march.cache_clear()
