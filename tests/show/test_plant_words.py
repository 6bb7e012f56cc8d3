"""The report speaks of the machine: faults, parts, sizes in units of the shop, and what to check."""

import re
from dataclasses import replace

import pytest

from belt_sim.campaign import Suspicion
from belt_sim.effects.library import library
from belt_sim.results.diagnosis import RESOLVED, Estimate, FoundEffect, NextRun, Verdict
from belt_sim.show.report import HERE, LIKELY, plant_card, plant_headline, run_advice

TAPER = FoundEffect(
    id="taper",
    numbers={"kappa_t": 1e-6, "kappa_t_head": 2e-5},
    parameters={n: Estimate(v, 1e-6, "1/m", True) for n, v in (("kappa_t", 1e-6), ("kappa_t_head", 2e-5))},
    probability=0.97,
)


CAMBER = Estimate(9.86e-5, 2e-5, "1/m", True)


class Said:
    """A diagnosis as far as its headline goes."""

    def __init__(self, verdict, suspicions=()):
        self.verdict, self.suspicions = verdict, suspicions


def test_every_effect_of_the_library_has_words_and_parts_of_the_sketch():
    drawn = set(re.findall(r'part\("(\w+)"\)', (HERE / "sketch.svg.j2").read_text(encoding="utf-8")))
    causes = [cls.cause for cls in library().values()]
    assert all(cause is not None and cause.phrase and cause.check for cause in causes)
    assert {part for cause in causes for part in cause.parts} <= drawn


def test_the_pulley_is_the_one_whose_number_stands_out():
    found = plant_card(TAPER)
    assert found["parts"] == ("head",)
    assert found["fault"] == "the head pulley is conical"
    assert plant_headline(Said(Verdict.EXPLAINED), [found]) == "Most likely the head pulley is conical"


def test_an_improbable_cause_is_marked_and_said_to_be_possible_only():
    unsure = plant_card(replace(TAPER, probability=LIKELY - 0.01, confusable_with=(("crown", "cant"),)))
    assert unsure["unsure"]
    assert "(crown + cant)" in unsure["others"][0]
    assert plant_headline(Said(Verdict.EXPLAINED), [unsure]).startswith("Perhaps")


@pytest.mark.parametrize(
    ("unit", "value", "said"),
    [
        ("rad", 1e-3, "1.00 ± 0.10 mm/m"),
        ("m", 2e-3, "2.00 ± 0.20 mm"),
        ("Pa", 3e6, "3.00 ± 0.30 N/mm²"),
        ("1", 0.5, "0.500 ± 0.050"),
        ("s", 0.5, "0.500 ± 0.050 s"),
    ],
)
def test_numbers_are_in_units_of_the_shop(unit, value, said):
    assert str(Estimate(value, 0.1 * value, unit, True)) == said


def test_an_effect_may_have_its_own_unit():
    camber = FoundEffect(id="camber", numbers={}, parameters={"kappa_c": CAMBER}, probability=0.99)
    assert plant_card(camber)["sizes"] == ("natural curvature: 1.23 ± 0.25 mm of bow over 10 m",)
    assert "kappa_c = 1.23 ± 0.25 mm of bow over 10 m" in str(camber)


NO_POWER = 1e-3, 1e4  # as large as a number may be that is written without a power of ten


def test_every_number_of_the_library_is_readable_at_the_size_that_matters():
    for cls in library().values():
        for name, declared in cls.parameters.items():
            factor, unit = declared.display_unit
            assert NO_POWER[0] <= abs(factor * declared.scale) <= NO_POWER[1], (cls.id, name, unit)


def test_a_run_that_resolves_nothing_is_not_said_to_tell():
    pair = ("taper", "crown")
    assert run_advice(NextRun("reverse", pair, 0.1, RESOLVED - 0.1)).startswith("No single further run")
    assert "It tells taper from crown" in run_advice(NextRun("reverse", pair, 0.1, RESOLVED + 0.1))
    assert "no single further run" in str(NextRun("reverse", pair, 0.1, 1e-6))


def test_no_effect_and_damaged_data_have_headlines_of_their_own():
    stopped = Suspicion(run="r1", signals=("y1",), kind="clipped", sentence="y1 of r1 stops at 3 mm", severity="stop")
    said = [Said(v) for v in (Verdict.ADEQUATE, Verdict.NONE_KNOWN, Verdict.CANNOT_SAY)]
    said = {plant_headline(s, []) for s in (*said, Said(Verdict.CANNOT_SAY, (stopped,)))}
    assert len(said) == 4
