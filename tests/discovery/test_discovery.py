"""What is hidden and in no library is found, said and added; what is not there is not found."""

import json
from dataclasses import replace

import numpy as np
import pytest
from shipped_schema import check
from small_discovery import MODEL, PLAN, D, campaign, described, discovered, fitted

import belt_sim as bs
from belt_sim.api.plot import discovery_by_kind, draw_discovery
from belt_sim.commands.outputs import write_discovery
from belt_sim.diagnosis.fits.workbench import workbench
from belt_sim.diagnosis.left_over.openset import apart, basis
from belt_sim.discovery.describe import carries_over, describe
from belt_sim.discovery.discover import discover, unknown_columns
from belt_sim.discovery.gate import gate
from belt_sim.discovery.look import Looking
from belt_sim.discovery.words import sentence
from belt_sim.effects.library import library
from belt_sim.errors import InputError
from belt_sim.results.errors import Errors, OwnChange
from belt_sim.results.json import discovery_json, read_discovery
from belt_sim.virtual_rig.make import make_campaign

SLOW = 0.15  # of the travel, by which an encoder is off
EXPLAINED = 0.9  # of the hidden effect's chi2, D^2


def test_nothing_is_discovered_where_nothing_is_hidden():
    found = described()
    assert not found.found
    assert found.law is None
    assert "Nothing is missing" in found.sentence


def test_a_yaw_that_creeps_is_found_at_its_place_with_its_law():
    found = described("yaw_creep")
    assert found.places[0].place == "yaw_tail"
    assert found.places[0].pool == "odd"
    assert found.law is not None
    assert found.law.place == "yaw of the tail pulley"
    assert "β" in found.law.formula
    assert found.law.parity == "odd"
    assert found.law.exponent is not None
    assert abs(found.law.exponent.value) < 3.0 * found.law.exponent.u
    assert discovered("yaw_creep").refit.gain > EXPLAINED * D**2


def test_the_held_out_error_falls():
    error = described("yaw_creep").error
    assert error.held_out.after < 0.8 * error.held_out.before


def test_the_written_effect_lets_the_error_fall_in_a_comparison(tmp_path):
    write_discovery(tmp_path, described("yaw_creep"))
    draw_discovery(tmp_path, described("yaw_creep"))
    compared = bs.compare(campaign("yaw_creep"), "strip", [str(tmp_path / "found_effect.py")], drawn=False)
    assert compared.error.fit.after < 0.8 * compared.error.fit.before
    assert {p.name for p in tmp_path.glob("*.png")} == {f"{n}.png" for n in discovery_by_kind(described("yaw_creep"))}
    content = json.loads((tmp_path / "discovery.json").read_text())
    check(content)
    read = read_discovery(content)
    assert discovery_json(read) == discovery_json(described("yaw_creep"))


def test_the_columns_of_the_unknown_leave_nothing_for_the_gate():
    bench, fit = fitted("yaw_creep")
    columns = unknown_columns(discovered("yaw_creep"))
    assert columns.shape[1:] == bench.samples.y.shape
    white = bench.metric.whiten(columns)
    left = fit.residual - np.linalg.lstsq(white.T, fit.residual, rcond=None)[0] @ white
    assert fit.chi2 - left @ left > EXPLAINED * D**2


def test_beside_a_law_anything_smooth_at_its_place_is_free():
    """What is at work is seldom the very law that was found: a bump in travel is no form of it."""
    (bench, _), found = fitted("yaw_creep"), discovered("yaw_creep")
    assert found.refit is not None
    grid = found.survey.ops.grid
    bump = found.course.weights[0][:, None] * np.sin(np.pi * grid / grid[-1])[None] ** 2
    does = bench.metric.whiten(found.survey.readings(found.course.place, bump[None]))
    left = apart(does, basis(bench.metric.whiten(unknown_columns(found))))
    assert np.linalg.norm(left) < 0.1 * np.linalg.norm(does)


def test_the_gate_closes_on_what_is_missing_only():
    assert gate(*fitted("yaw_creep"), draws=40).failed
    assert not gate(*fitted(), draws=40).failed


def test_what_only_other_tests_have_seen_is_given_no_place():
    found = describe(discover(*fitted(), draws=40, failed=True))
    assert not found.found
    assert "no place" in found.sentence


def test_a_law_that_predicts_worse_than_none_is_told_so():
    law = discovered("yaw_creep")
    assert carries_over(described("yaw_creep").error)
    assert "carry over" not in described("yaw_creep").sentence
    worse = sentence(law.survey, law.refit, 1.0, "creep", alone=True, carries=False)
    assert "does not carry over" in worse
    for after, fine in ((0.9, True), (1.1, False)):
        own = OwnChange(before=1.0, after=after, floor=0.5)
        assert carries_over(Errors(noise_floor=0.5, own=own)) == fine
    assert carries_over(Errors(noise_floor=0.5, own=OwnChange(before=0.1, after=0.4, floor=0.5)))


def test_a_law_stands_in_the_march_beside_effects_and_by_itself():
    """Beside nothing both fits are the same; the law is the one that was hidden."""
    bench, fit = fitted("yaw_creep")
    made = Looking(seed=0, draws=40).together(bench, fit)
    assert made is not None
    assert made.law.ids == made.both.ids == ("found_effect",)
    assert made.law.chi2 == pytest.approx(made.both.chi2, abs=0.1)
    assert fit.chi2 - made.both.chi2 > EXPLAINED * D**2


def test_one_law_explains_what_was_hidden_and_is_not_sought_for_more():
    bench, fit = fitted("yaw_creep")
    look = Looking(seed=0, draws=40)
    law = look.one_law(bench, fit, 0.5 * D**2)
    assert law is not None
    assert "yaw of the tail pulley" in law.words
    assert fit.chi2 - bench.metric.chi2(bench.fitted.y - law.values) > EXPLAINED * D**2
    assert law.price > 10.0  # it is the best of thousands
    assert look.one_law(bench, fit, 1.5 * D**2) is None
    assert look.one_law(*fitted(), 20.0) is None  # nothing is hidden


def leads_of(d):
    """How far ahead of a right effect of size ``d`` the best law gets, in campaigns drawn by chance."""
    made = make_campaign(hidden=[{"id": "yaw_offset_tail", "d": d}], base="strip", seed=3, plan=PLAN)[0]
    bench = workbench(made, MODEL, [library()["yaw_offset_tail"]])
    base, right = (bench.fit([bench.start(ids, bench.forward.null())])[0] for ids in ((), ("yaw_offset_tail",)))
    return Looking(seed=0, draws=10).lead_by_chance(bench, base, right)


def test_an_encoder_that_shows_too_little_is_compared_over_the_travel_that_it_stands_for():
    """Beside it the belt goes further than beside none, and an input to it has more cells, or longer ones."""
    made = make_campaign(base="strip", seed=3, plan=PLAN)[0]
    bench = workbench(made, MODEL, [library()["encoder_scale"]])
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    slow = bench.fit([bench.start(("encoder_scale",), bench.forward.null())])[0]
    counted = SLOW / bench.forward.slots[0].scale
    for off in (counted, -counted):
        slow.vector[0] = off
        assert np.isfinite(Looking(seed=0, draws=1).lead_by_chance(bench, base, slow)).all()


def test_a_law_gets_ahead_of_a_right_effect_by_chance():
    """A constant yaw of the tail pulley is among the laws: none ever stays behind. Of a large effect, laws that say
    something else nearly always stay behind.
    """
    small, large = leads_of(6.0), leads_of(D)
    assert min(small.min(), large.min()) > -0.1
    assert small.max() > 1.0
    assert np.quantile(large, 0.9) < 0.1 < np.quantile(small, 0.9)


def test_the_written_effect_holds_nothing_that_it_does_not_call():
    text = described("yaw_creep").effect_file
    assert "_since(case" in text
    assert [word for word in ("_rate", "response", "import jax\n") if word in text] == []


def test_too_few_runs_are_said_and_no_law_is_guessed():
    whole = campaign("yaw_creep")
    few = replace(whole, runs=whole.runs[:2])
    bench = workbench(few, MODEL, [])
    found = describe(discover(bench, bench.fit([bench.start((), bench.forward.null())])[0], draws=40))
    assert not found.found
    assert "Too few runs" in found.sentence
    assert any("one tension" in text for text in found.limits)


def test_a_file_of_another_version_is_refused():
    with pytest.raises(InputError, match="another version"):
        read_discovery({"schema": "belt-discovery/0"})
