"""A change of a span's own stiffness is found at its place, and told by how much, at every tension."""

from dataclasses import replace
from types import SimpleNamespace

import jax
import numpy as np
import pytest
from small_discovery import at_few_places, surveyed, surveyed_at_one_tension

from belt_sim.discovery.closed_loop import solve_loop
from belt_sim.discovery.linear_search import unexplained_elsewhere
from belt_sim.discovery.search_data import SearchData
from belt_sim.discovery.selection import choose_law
from belt_sim.discovery.words import _by_how_much, formula, looks_like, sentence
from belt_sim.effects.law import LAW_PLACES, Form, Law, Term
from belt_sim.jax_setup import in_float64
from belt_sim.line.span import response, strip, with_change
from belt_sim.results.errors import Change, Errors

SHARE, POWER = -0.1, -1.0
SETTINGS = 0.15  # runs are not at the tension at which they were set, and two digits are told
SIZE = 40.0  # sigma of what is hidden
POWERS = 0.02  # of what a change does: between CHANGES seven powers of its logarithm stand for it
LINEAR = 0.15  # of what a change of this size does: the loop has its steps on a grid of 0.2 m, the march half as long


def law_of(data: SearchData, name: str, form: Form, exponent: float = 0.0) -> Law:
    return Law((Term(next(p for p in data.places if p.name == name), form, exponent),))


def hidden(name: str, exponent: float) -> SearchData:
    """A survey of a campaign that hides a change of a stiffness by SHARE, at the unit of tension."""
    data = surveyed()
    made = solve_loop(data, law_of(data, name, Form("none"), exponent), np.array([[SHARE]]))
    row = made[0][0]
    noise = np.random.default_rng(0).standard_normal(row.shape)
    residual = noise + SIZE * row / np.linalg.norm(row)
    few = at_few_places(data, "torsion_both", "torsion_upper", "bending_both", "bending_upper", "yaw_tail", "tension")
    return replace(few, projector=replace(data.projector, residual=residual))


@pytest.mark.parametrize("name", ["torsion_both", pytest.param("bending_upper", marks=pytest.mark.long)])
def test_a_hidden_change_of_a_stiffness_is_found_at_its_place(name):
    data = hidden(name, POWER)
    choice = choose_law(data, data.latent_inputs[0], pairs=False)
    close = [s.law.terms[0].place.name for s in (choice.best, *choice.judged) if s.score > choice.best.score - 6.0]
    assert name in close
    assert choice.best.gain > 0.9 * choice.possible  # nuisances have taken their part


@pytest.mark.parametrize(("kind", "change"), [("torsion", -0.8), ("tension", -0.5), ("bending", 1.0)])
def test_the_loop_has_a_change_of_any_size(kind, change):
    """It adds to the curvature at the run-up what a span with that change has, and to the roll at mid-span."""
    data = surveyed()
    cases, ends = data.bench.samples.cases, data.states.ends[:, :3]
    per_end = [data.states.changes[kind].per_end(np.full_like(ends[:, :1], change), row) for row in (0, 1)]
    found = [np.einsum("irfj,rij->rj", factors, ends) for factors in per_end]
    for r in range(len(ends)):
        case = replace(cases, settings=jax.tree.map(lambda x, r=r: np.asarray(x)[r], cases.settings))
        before, after = (in_float64(response)(x) for x in (strip(case), with_change(strip(case), case, kind, change)))
        for name, added in zip(("runup", "mid_tilt"), found, strict=True):
            true = np.asarray(getattr(after, name) - getattr(before, name))[:3] @ ends[r]
            assert added[r] == pytest.approx(true, rel=POWERS, abs=POWERS * float(np.abs(true).max()))


def test_by_how_much_a_stiffness_changes_is_told_at_every_tension():
    data = surveyed()
    law = law_of(data, "torsion_upper", Form("none"), POWER)
    numbers = {"size": (SHARE, 0.01, "1"), "exponent": (POWER, 0.1, "1")}
    said = _by_how_much(data, law, numbers)
    assert said.startswith("lower than in the model by ")
    for tension in np.unique(data.stated_tension):
        share = abs(SHARE) * data.tension / tension  # exponent -1
        own = next(part for part in said.split(", ") if f"at {tension / 1e6:g} N/mm²" in part)
        assert float(own.partition(" %")[0].split()[-1]) == pytest.approx(100.0 * share, rel=SETTINGS)
    assert "× tension^(−1.00 ± 0.10)" in formula(law, numbers)
    assert law.terms[0].place.words == "torsional stiffness of the upper span"


def test_a_threshold_in_tension_is_told_as_one():
    data = surveyed()
    law = law_of(data, "bending_both", Form("sigma", shape="below", knee=9e6))
    assert "below 9 N/mm²" in formula(
        law, {"size": (0.2, 0.01, "1"), "knee": (9e6, 1e5, "Pa"), "exponent": (0, 0, "1")}
    )


@pytest.mark.parametrize(("course", "said"), [("constant", "is off all along"), ("linear", "warms up or settles")])
def test_a_yaw_that_nothing_drives_is_told_by_its_course(course, said):
    law = law_of(surveyed(), "yaw_tail", Form("none", course=course))
    assert looks_like(surveyed(), law) == f"the stand of a pulley: it {said}"


@pytest.mark.parametrize(
    ("size", "said"),
    [
        (-0.25, "A stretch of the belt bends more easily, as with"),
        (0.1, "A stretch of the belt bends less easily, as with"),
    ],
)
def test_a_stretch_of_the_belt_is_told_as_so_much_more_or_less_of_it(size, said):
    data = surveyed()
    form = Form("none", course="belt_section", at=1.2, wide=0.1)
    term = Term(next(p for p in LAW_PLACES.values() if p.name == "bending_carried"), form)
    length = abs(size) * float(data.bench.samples.cases.rig.span_length)
    numbers = {"size": (size, 1e-4, "1"), "at": (1.2, 0.01, "m")}
    made = SimpleNamespace(scored=SimpleNamespace(law=Law((term,))), estimates=lambda: numbers, exponent=(0.0, 0.0))
    law, errors = (
        SimpleNamespace(parity="odd", looks_like=""),
        Errors(noise_floor=1e-5, fit=Change(before=2e-4, after=1e-4)),
    )
    told = sentence(data, made, law, errors)
    assert told.startswith(said)
    assert float(told.removeprefix(said).split()[0]) == pytest.approx(length, rel=1e-3)


@pytest.mark.parametrize(("exponent", "told"), [((2.2, 7600.0), True), ((2.0, 0.9), False), ((2.0, 0.0), False)])
def test_an_exponent_that_nothing_shows_is_told_as_one(exponent, told):
    """Guard: a span too stiff to bend was told as nine times as stiff at 20 N/mm² and 59 times at 50."""
    law = law_of(surveyed(), "bending_upper", Form("none"), 2.0)
    numbers = {"size": (9.4, 0.4, "1"), "exponent": (2.0, 0.0, "1")}
    made = SimpleNamespace(scored=SimpleNamespace(law=law), estimates=lambda: numbers, exponent=exponent)
    shown = SimpleNamespace(parity="odd", looks_like="")
    errors = Errors(noise_floor=1e-5, fit=Change(before=2e-4, after=1e-4))
    assert ("do not tell that exponent from 0 (2 ± 7600)" in sentence(surveyed(), made, shown, errors)) == told


ALIKE = 0.04  # of what a law makes of the readings, which another place leaves: a correlation of 0.98
LOOK_ALIKES = {
    "bending_carried": (Form("none", course="belt_section", at=0.3, wide=0.02), {"turn_carried"}),
    "pull_upper": (Form("none"), {"turn_tail"}),
    "torsion_upper": (Form("none", course="rise", at=12.0), {"pull_upper", "bending_upper"}),
}


@pytest.mark.parametrize("name", LOOK_ALIKES)
def test_places_that_a_plan_cannot_tell_apart_are_told(name):
    """At one tension a soft joint is a bend of the belt as it lands, and the stiffnesses of one span act alike; three
    tensions tell each of them."""
    form, alike = LOOK_ALIKES[name]
    found = []
    for data in (surveyed_at_one_tension(), surveyed()):
        law = law_of(data, name, form)
        shown = replace(data, projector=replace(data.projector, residual=data.columns(law)[0]))
        whole = shown.projector.chi2()
        found.append({p.name for p, left in unexplained_elsewhere(shown, law).items() if left < ALIKE * whole})
    assert alike <= found[0]
    assert not found[1]
