"""What an unknown law makes hold-out refuse is judged beside that law."""

from types import SimpleNamespace

import numpy as np
import pytest
from linear_bench import SPREAD, WHITE, linear_bench

from belt_sim.diagnosis.answer import verdict as deciding
from belt_sim.diagnosis.choice.beside_a_law import refused, stands
from belt_sim.diagnosis.choice.chance import chance_of
from belt_sim.diagnosis.choice.refits import Trial
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.heldout import held_out
from belt_sim.diagnosis.left_over.openset import OpenSet
from belt_sim.diagnosis.left_over.unknown import Together

COUNT, THRESHOLD = 40, 10.0
TENSION = np.array([r.tension / 14e6 for r in SPREAD])[:, None, None]
STEP = np.where(np.arange(COUNT) % 7 == 0, 1.0, 0.0)
SLOPE = STEP + 0.5 * np.cos(np.arange(COUNT))
EFFECT, LAW = WHITE.white * STEP * np.ones_like(TENSION), WHITE.white * SLOPE * TENSION**2
KNOWN = SimpleNamespace(columns=lambda: LAW[None])
SMOOTH = OpenSet(("smooth, odd in yaw",), {}, {}, {})


def readings(effect, law):
    noise = WHITE.white * np.random.default_rng(1).normal(size=(len(SPREAD), 1, COUNT))
    return effect * EFFECT + law * LAW + noise


def selection(y):
    """Nothing was chosen of a library that holds one effect; the same campaign with a law on the workbench."""
    bench = linear_bench(SPREAD, y=y, shapes={"effect": EFFECT, "law": LAW})
    base = bench.fit([bench.start((), np.zeros(2))])[0]
    alone = bench.fit([bench.start(("effect",), np.zeros(2))])[0]
    trial = Trial("effect", bench, alone, base.chi2 - alone.chi2, THRESHOLD)
    found = SimpleNamespace(
        rounds=[[trial]], chosen=base, base=base, bench=bench, base_bench=bench, threshold=lambda name: THRESHOLD,
        base_held_out=held_out(bench, base), chance=chance_of(bench, bench.samples.y - base.values, 0),
    )  # fmt: skip
    return found, trial


class Looked:
    """A search that knows the law."""

    def together(self, bench, fit):
        law, both = bench.fit([bench.start(ids, np.zeros(2)) for ids in (("law",), ("effect", "law"))])
        return Together(bench, law, both)


def test_an_effect_that_an_unknown_spoils_stands_beside_it():
    found, trial = selection(readings(5.0, 20.0))
    assert trial.passes
    assert found.chance.worse(trial.held_out, found.base_held_out)  # it takes on what grows with the tension
    assert refused(found, SMOOTH, KNOWN) is trial
    assert stands(found, trial.fit, Looked())


def test_an_effect_that_the_law_alone_does_without_is_not_there():
    found, trial = selection(readings(0.0, 20.0))
    assert trial.passes
    assert found.chance.worse(trial.held_out, found.base_held_out)
    assert refused(found, SMOOTH, KNOWN) is None
    assert not stands(found, trial.fit, Looked())


def test_nothing_is_refused_where_something_was_chosen_or_predicts_well():
    found, trial = selection(readings(5.0, 0.0))
    assert not found.chance.worse(trial.held_out, found.base_held_out)
    assert refused(found, SMOOTH, KNOWN) is None
    found, trial = selection(readings(5.0, 20.0))
    found.chosen = trial.fit
    assert refused(found, SMOOTH, KNOWN) is None


@pytest.mark.parametrize(("needed", "predicts"), [(True, True), (True, False), (False, True)])
def test_a_verdict_asks_what_hold_out_refused(monkeypatch, needed, predicts):
    """With nothing chosen and something left; what does not stand then leaves the verdict as it was."""
    bare, fit = Fit(ids=(), free=[], vector=np.zeros(1)), Fit(ids=("effect",), free=[], vector=np.zeros(1))
    unknown = SimpleNamespace(failed=("a law",), columns=lambda: np.empty((0, 1, 1, 1)))
    other = SimpleNamespace(bench=None, chosen=fit, threshold=None)
    found = SimpleNamespace(base_bench=None, instead=lambda ids: other)
    before = deciding.Judgement(bare, None, SMOOTH, SMOOTH, unknown=unknown)
    monkeypatch.setattr(deciding, "_judged", lambda *args, **more: before)
    monkeypatch.setattr(deciding, "_columns", lambda *args: np.empty((0, 1, 1, 1)))
    monkeypatch.setattr(deciding, "refused", lambda *args: SimpleNamespace(id="effect"))
    monkeypatch.setattr(deciding, "open_set", lambda *args, **more: SMOOTH)
    monkeypatch.setattr(deciding, "members_that_stay", lambda *args: fit if needed else None)
    monkeypatch.setattr(deciding, "probabilities", lambda *args: {"effect": 0.7})
    monkeypatch.setattr(deciding, "stands", lambda *args: predicts)
    monkeypatch.setattr(deciding, "held_out", lambda *args: "held out")
    found = deciding.judged(found, bootstraps=100, seed=0, look=lambda *args: unknown)
    assert found.named.ids == (("effect",) if needed and predicts else ())
    assert found.instead is (other if needed and predicts else None)
