"""Several effects are no finding where one law does as well, and what a search for laws sees reaches the verdict."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import numpy as np
import pytest

from belt_sim.diagnosis.answer import verdict as deciding
from belt_sim.diagnosis.answer.verdict import judged, verdict
from belt_sim.diagnosis.choice import rise
from belt_sim.diagnosis.choice.occam import imitated, outdone
from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.left_over.openset import OpenSet
from belt_sim.diagnosis.left_over.unknown import OneLaw
from belt_sim.results.verdict import Verdict

THRESHOLD, COST, SEARCHED = 12.0, 5.0, 20.0
BASE_CHI2 = 500.0  # of the base model
CLEAN, SMOOTH = OpenSet((), {}, {}, {}), OpenSet(("smooth, odd in yaw",), {}, {}, {})


@dataclass
class Looked:
    """A search that sees what is written down: laws it fails the fit for, what one law explains of BASE_CHI2, and how
    far ahead of right effects the best one gets by chance; beyond: laws that fail the model without any.
    """

    failed: tuple[str, ...] = ()
    explains: float | None = None
    leads: tuple[float, ...] = (-1.0,)
    beyond: tuple[str, ...] = ("a law",)
    asked: list = field(default_factory=list)

    def __call__(self, bench, fit, failed):
        self.asked.append((fit.ids, failed))
        return SimpleNamespace(failed=self.failed if fit.ids else self.beyond, columns=lambda: np.empty((0, 1, 1, 1)))

    def one_law(self, bench, fit, least, *, closely=False):
        self.asked.append("one law, closely" if closely else "one law")
        if self.explains is None:
            return None
        return OneLaw("yaw: s", np.array([[[self.explains]]]), COST, SEARCHED)

    def lead_by_chance(self, bench, base, effects):
        self.asked.append(("by chance", base.ids, effects.ids))
        return np.array(self.leads)


def chosen_by(gain, ids=("a", "b"), inflation=1.0, last=100.0):
    """A selection of ``ids`` that explains ``gain`` of BASE_CHI2, the last of them so much beside the others; a law's
    one number stands for what it explains.
    """
    fit = Fit(ids=ids, free=[], vector=np.zeros(2), chi2=BASE_CHI2 - gain)
    metric = SimpleNamespace(
        chi2=lambda left: BASE_CHI2 + float(left[0, 0, 0])
    )  # y is 0: left is less what it explains
    still = np.zeros((1, 1, 1))
    bench = SimpleNamespace(metric=metric, fitted=SimpleNamespace(y=still), levels=None, at_levels=lambda levels: bench)
    base = Fit(ids=(), free=[], vector=np.zeros(2), chi2=BASE_CHI2, values=still)
    return SimpleNamespace(
        chosen=fit, base=base, bench=bench, base_bench=bench, gain=gain, threshold=lambda name: THRESHOLD,
        null=SimpleNamespace(inflation=lambda name: inflation),
        rounds=(),
        swaps={i: [SimpleNamespace(id=i, gain=last if i == ids[-1] else 100.0)] for i in ids},
        base_left=CLEAN.and_failed(("smooth, odd in yaw",)), base_held_out="base", held_out="chosen",
    )  # fmt: skip


def test_two_effects_that_one_law_does_as_well_as_are_an_imitation():
    (why,) = imitated(chosen_by(400.0), Looked(explains=410.0))
    assert "one law" in why
    assert imitated(chosen_by(400.0), Looked(explains=398.0))  # nearly as well, with one number


def test_one_law_that_explains_more_than_another_model_stands_in_its_way():
    """Of 325 a law is worth 300, its numbers and its search paid; 6 more is a likelihood ratio of 20."""
    for explains, outdoes in ((None, False), (329.0, False), (333.0, True)):
        look = Looked(explains=explains)
        assert outdone(chosen_by(0.0, ids=()), 300.0, look) is outdoes
        assert look.asked == ["one law, closely"]


def test_another_model_is_not_advised_where_a_law_explains_more(monkeypatch):
    rung = SimpleNamespace(gain=300.0)
    monkeypatch.setattr(deciding, "ladder", lambda bench, chi2: [rung])
    monkeypatch.setattr(deciding, "better_model", lambda rungs, asked, chosen, value: rungs[0])
    found = chosen_by(0.0, ids=())
    found.base_bench.forward = SimpleNamespace(model=None)
    assert deciding._better_model(found, None) is rung
    assert deciding._better_model(found, Looked(explains=310.0)) is rung
    assert deciding._better_model(found, Looked(explains=400.0)) is None


@pytest.mark.parametrize("explains", [None, 250.0, 395.0])
def test_two_effects_that_explain_more_than_any_law_stand(explains):
    """A law has to explain 400 - 2 x 12 - 4.6 + 25 = 396.4 to be worth as much."""
    assert imitated(chosen_by(400.0), Looked(explains=explains)) == ()


def test_one_effect_gives_way_to_a_law_that_explains_clearly_more_only():
    """One known fault is likelier than an unknown law: 400 - 12 + 4.6 + 25 = 417.6."""
    assert imitated(chosen_by(400.0, ("a",)), Looked(explains=415.0)) == ()
    assert imitated(chosen_by(400.0, ("a",)), Looked(explains=420.0))


@pytest.mark.parametrize(("last", "stands"), [(14.0, True), (50.0, False)])
def test_a_second_effect_does_not_cost_the_first_its_name(last, stands):
    """Alone the first is worth 400 - 14 - 12 + 4.6 = 378.6, both 400 - 24 - 4.6 = 371.4, the law 400 - 25 = 375."""
    assert (imitated(chosen_by(400.0, last=last), Looked(explains=400.0)) == ()) == stands


def test_a_law_behind_the_effects_has_to_beat_chance_by_itself():
    """It is worth more only for what its number costs; where the model without any passes for right, it is none."""
    assert imitated(chosen_by(400.0), Looked(explains=398.0))
    assert imitated(chosen_by(400.0), Looked(explains=398.0, beyond=())) == ()
    assert imitated(chosen_by(400.0), Looked(explains=402.0, beyond=()))  # ahead of them: not its price alone decides


@pytest.mark.parametrize(("leads", "gives_way"), [(14.0, True), (16.0, False)])
def test_one_effect_keeps_its_name_where_laws_get_as_far_ahead_of_a_right_one(leads, gives_way):
    """420 is 20 more than the effect explains, 15 with the law's numbers paid."""
    look = Looked(explains=420.0, leads=(*[-1.0] * 97, leads, leads))
    assert bool(imitated(chosen_by(400.0, ("a",)), look)) == gives_way
    assert look.asked == ["one law", ("by chance", (), ("a",))]


def test_several_effects_are_no_likelier_for_what_chance_makes_of_laws():
    look = Looked(explains=410.0, leads=(100.0,))
    assert imitated(chosen_by(400.0), look)
    assert look.asked == ["one law, closely"]


def test_a_law_costs_more_where_noise_levels_are_uncertain():
    """Chance gives a law as much more as it gives the effects: 400 - 12 + 4.6 + 2 x 25 = 442.6."""
    assert imitated(chosen_by(400.0, ("a",), inflation=2.0), Looked(explains=440.0)) == ()
    assert imitated(chosen_by(400.0, ("a",), inflation=2.0), Looked(explains=445.0))


def test_a_law_is_no_cheaper_than_the_effect_that_says_the_same():
    """An effect with a wide grid has a high threshold; its twin among the laws, as good, may not undercut that."""
    found = chosen_by(400.0, ("a",))
    found.threshold = lambda name: 60.0
    assert imitated(found, Looked(explains=402.0)) == ()
    assert imitated(found, Looked(explains=406.0))


def test_the_more_faults_at_once_the_more_they_have_to_explain():
    """Three: 400 - 3 x 12 - 9.2 + 25 = 379.8."""
    assert imitated(chosen_by(400.0, ("a", "b", "c")), Looked(explains=378.0)) == ()
    assert imitated(chosen_by(400.0, ("a", "b", "c")), Looked(explains=382.0))


@pytest.fixture
def passing(monkeypatch):
    """All other tests of a verdict pass."""
    monkeypatch.setattr(deciding, "open_set", lambda *args, **more: CLEAN)
    monkeypatch.setattr(deciding, "beyond_floor", lambda *args: ())
    monkeypatch.setattr(deciding, "_better_model", lambda found, look: None)
    monkeypatch.setattr(deciding, "probabilities", lambda found, unknown: dict.fromkeys(found.chosen.ids, 1.0))
    monkeypatch.setattr(deciding, "_rises", lambda found, held: ())


def test_effects_without_anything_left_are_explained(passing):
    found = judged(chosen_by(400.0), bootstraps=1, seed=0, look=Looked())
    assert (verdict(found, ()), found.named.ids) == (Verdict.EXPLAINED, ("a", "b"))


def test_an_imitation_is_none_known_and_the_base_model_is_searched(passing):
    look = Looked(explains=410.0)
    found = judged(chosen_by(400.0), bootstraps=1, seed=0, look=look)
    assert (verdict(found, ()), found.named.ids, found.nearest.ids) == (Verdict.NONE_KNOWN, (), ("a", "b"))
    assert "one law" in found.why
    assert set(look.asked[:2]) == {(("a", "b"), False), "one law, closely"}  # side by side
    assert look.asked[2:] == [((), True)]


def test_a_law_seen_beside_the_effects_takes_their_names(passing, monkeypatch):
    monkeypatch.setattr(deciding, "unknown_columns", lambda bench, left: np.empty((0, 1, 1, 1)))
    monkeypatch.setattr(deciding, "members_that_stay", lambda *args: None)
    look = Looked(failed=("a law beyond the library",), explains=410.0)
    found = judged(chosen_by(400.0), bootstraps=1, seed=0, look=look)
    assert (verdict(found, ()), found.named.ids) == (Verdict.NONE_KNOWN, ())
    assert found.fails == ("a law beyond the library",)  # and not that one law in their place does better
    assert set(look.asked[:2]) == {(("a", "b"), False), "one law, closely"}
    assert look.asked[2:] == [((), True)]


def test_what_fails_already_is_told_to_the_search(passing, monkeypatch):
    monkeypatch.setattr(deciding, "open_set", lambda *args, **more: SMOOTH)
    monkeypatch.setattr(deciding, "unknown_columns", lambda bench, left: np.empty((0, 1, 1, 1)))
    monkeypatch.setattr(deciding, "members_that_stay", lambda *args: None)
    look = Looked()
    judged(chosen_by(400.0), bootstraps=1, seed=0, look=look)
    assert look.asked == [(("a", "b"), True), ((), True)]


def judged_with(monkeypatch, *, rises=(), after=1.0, beside_base=True):
    """A set that leaves something and is needed beside it; beside_base: also beside what is seen with nothing named;
    after: its held-out error over that of the base model.
    """
    found = chosen_by(400.0)
    stays = Fit(ids=("a",), free=[], vector=np.zeros(2), values=np.full((1, 1, 1), 300.0))
    seen = {"base": np.ones((2, 1, 1, 1)), "set": np.zeros((0, 1, 1, 1))}
    found.chance = SimpleNamespace(rises=lambda larger, smaller: rises)
    found.bench.fit, found.bench.start = lambda starts: [stays], lambda ids, vector: stays

    def look(bench, fit, failed, known=None):
        return SimpleNamespace(failed=(), columns=lambda: seen["set" if fit.ids else "base"], law=lambda: None)

    def needed(bench, fit, columns, threshold):
        return stays if beside_base or not len(columns) else None

    monkeypatch.setattr(deciding, "open_set", lambda *args, **more: SMOOTH)
    monkeypatch.setattr(deciding, "unknown_columns", lambda bench, left: seen["set"])
    monkeypatch.setattr(deciding, "members_that_stay", needed)
    monkeypatch.setattr(deciding, "held_out", lambda bench, fit: SimpleNamespace(tested=("yaw +",)))
    monkeypatch.setattr(deciding, "_rises", lambda found, held: ("more",) if held != "chosen" and after > 1.0 else ())
    return judged(found, bootstraps=1, seed=0, look=look)


def test_what_is_needed_beside_everything_seen_keeps_its_name(passing, monkeypatch):
    found = judged_with(monkeypatch)
    assert (verdict(found, ()), found.named.ids) == (Verdict.PARTLY, ("a",))


def test_a_name_that_the_unknown_of_the_base_model_replaces_is_none(passing, monkeypatch):
    """Beside the rest that a false name leaves, nothing speaks against it; beside the whole unknown much does."""
    found = judged_with(monkeypatch, beside_base=False)
    assert (verdict(found, ()), found.named.ids) == (Verdict.NONE_KNOWN, ())


@pytest.mark.parametrize("more", [{"rises": ("yaw +",)}, {"after": 1.1}])
def test_no_name_stays_with_which_held_out_conditions_are_predicted_worse(passing, monkeypatch, more):
    found = judged_with(monkeypatch, **more)
    assert (verdict(found, ()), found.named.ids) == (Verdict.NONE_KNOWN, ())


def test_no_name_stays_that_is_hardly_likely(passing, monkeypatch):
    monkeypatch.setattr(deciding, "probabilities", lambda found, unknown: {"a": 1e-3, "b": 1.0})
    found = judged_with(monkeypatch)
    assert (verdict(found, ()), found.named.ids) == (Verdict.NONE_KNOWN, ())


@pytest.mark.parametrize(("after", "named"), [(1.0, ("a", "b")), (1.1, ())])
def test_no_effect_is_found_with_which_the_error_that_is_told_rises(passing, monkeypatch, after, named):
    """Whatever the likelihood says: the base model then stands by its own tests, and the set is the nearest known."""
    told = {"base": 1.0, "chosen": after}
    monkeypatch.setattr(
        deciding, "_rises", lambda found, held: ("held-out error",) if told[held] > told["base"] else ()
    )
    found = judged(chosen_by(400.0), bootstraps=1, seed=0, look=Looked())
    assert found.named.ids == named
    if not named:
        assert (verdict(found, ()), found.nearest.ids) == (Verdict.NONE_KNOWN, ("a", "b"))
        assert found.why.endswith("held-out error")


@pytest.mark.parametrize(
    ("after", "likelier", "said"),
    [
        (0.9, (-5.0, -5.0), ()),
        (1.0, (-5.0, 5.0), ()),
        (1.2, (-5.0, -5.0), ("held-out error, 1.20 times the base model's",)),
        (1.002, (-5.0, 0.5), ()),  # what no report would show, where every condition becomes likelier
        (1.08, (-5.0, 0.5), ()),  # nor what a perfect model would leave
        (1.08, (-50.0, 5.0), ("held-out error, 1.08 times the base model's",)),
        (1.002, (-50.0, 5.0), ("held-out error, 1.00 times the base model's",)),
    ],
)
def test_the_error_that_is_told_is_the_one_beside_every_runs_own_settings(monkeypatch, after, likelier, said):
    def held(size, surprise):
        parts = {n: SimpleNamespace(surprise=x) for n, x in zip(("yaw +", "yaw -"), surprise, strict=True)}
        return SimpleNamespace(tested=tuple(parts), conditions=parts, size=size)

    found = chosen_by(400.0)
    found.base_held_out = held(1.0, (-90.0, -90.0))  # judged by the larger noise that is read beside no effect
    found.bare_held_out = held(1.0, (0.0, 0.0))
    monkeypatch.setattr(rise, "OwnErrors", lambda bench: SimpleNamespace(rms=lambda held, names: held.size, floor=1.1))
    assert deciding._rises(found, held(after, likelier)) == said
