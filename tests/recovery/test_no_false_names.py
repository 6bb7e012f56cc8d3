"""What must never be named: effects in a campaign that was set up wrongly, and effects in place of a stranger."""

import math
from dataclasses import replace

import pytest
from small_campaign import CLASSES, MODEL, SEED, SPREAD, campaign, diagnosed

from belt_sim.campaign import Quantity
from belt_sim.diagnosis.describe import describe
from belt_sim.diagnosis.examine import examine
from belt_sim.discovery.selection import LawSearch
from belt_sim.results.diagnosis import Verdict
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.plan import TEST_BELT, TEST_RIG

IN_RAD = math.pi / 180.0


def yaw_typed_in(factor):
    return lambda c: replace(c, runs=tuple(replace(r, yaw=factor * r.yaw) for r in c.runs))


def one_run_shifted(c):
    run = c.runs[2]
    moved = replace(run, signals={n: y + 0.05 for n, y in run.signals.items()})
    return replace(c, runs=(*c.runs[:2], moved, *c.runs[3:]))


def both_at_one_place(c):
    return replace(c, signals=tuple(replace(s, at="point_1") for s in c.signals))


def diagnosis(c):
    return describe(examine(c, MODEL, CLASSES, seed=SEED, laws=LawSearch()), seed=SEED)


def test_no_law_takes_the_place_of_an_effect_that_is_there():
    assert diagnosed("sag_roll").verdict is Verdict.EXPLAINED


@pytest.mark.parametrize(
    ("slip", "kind"),
    [
        (yaw_typed_in(IN_RAD), "unit_slip"),
        (yaw_typed_in(1e3 * IN_RAD), "unit_slip"),
        (one_run_shifted, "shifted"),
        (both_at_one_place, "same_place"),
    ],
    ids=["rad", "mrad", "shifted", "one place"],
)
def test_what_was_set_up_wrongly_is_said_and_nothing_is_named(slip, kind):
    found = diagnosis(slip(campaign("nothing")))
    assert found.verdict is Verdict.CANNOT_SAY
    assert (found.effects, found.ranking) == ((), ())  # nothing was searched for
    assert kind in {s.kind for s in found.suspicions if s.severity == "stop"}


@pytest.mark.long
def test_a_short_rig_whose_sheet_forgets_zero_is_told_so_and_diagnosed():
    """Offsets of the runs once became tension_bias, crown, taper and cant, with a held-out error that rose."""
    short = replace(SPREAD, machine=replace(TEST_RIG, centre_distance=Quantity(value=2.0, u=0.005)))
    hidden = [{"id": "yaw_offset_tail", "beta_0": 5e-4}]
    made = make_campaign(hidden=hidden, seed=1, plan=short)[0]
    assert {e.id for e in diagnosis(made).effects} <= {"yaw_offset_tail"}
    forgotten = replace(made, signals=tuple(replace(s, zero=0.0) for s in made.signals))
    found = diagnosis(forgotten)
    assert {e.id for e in found.effects} <= {"yaw_offset_tail"}
    assert "zero" in {s.kind for s in found.suspicions}


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_nothing_is_found_on_a_wide_belt_without_anything_hidden(seed):
    wide = replace(SPREAD, belt=replace(TEST_BELT, width=Quantity(value=1.5, u=1e-4)))
    found = diagnosis(make_campaign(seed=seed, plan=wide)[0])
    assert (found.verdict, found.suspicions) == (Verdict.ADEQUATE, ())


@pytest.mark.long
@pytest.mark.parametrize(
    "stranger",
    [
        {"id": "dead_zone", "kappa_d": 1e-5},
        {"id": "yaw_creep", "share": 0.2},
        {"id": "adhesion_loss", "share": 0.15},
        {"id": "quadratic_contact", "c": 0.05},
        {"id": "warming_stand", "c": 3e-5},
        {"id": "strange_wave", "amplitude": 1e-4, "wavelength": 3.5},
        {"id": "strange_wave", "amplitude": 1e-4, "wavelength": 6.4},
    ],
    ids=lambda s: f"{s['id']} {s.get('wavelength', '')}",
)
def test_a_stranger_is_never_explained(stranger):
    found = diagnosis(make_campaign(hidden=[stranger | {"d": 15}], seed=2, plan=SPREAD)[0])
    assert (found.verdict, found.effects) == (Verdict.NONE_KNOWN, ())
    assert found.unknown is not None
