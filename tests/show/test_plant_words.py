"""The report speaks of the machine: faults, parts, sizes in units of the shop, and what to check."""

import math
import re
from dataclasses import replace
from itertools import combinations
from types import SimpleNamespace

import pytest
from small_campaign import drawn

from belt_sim.api.plot import write_diagnosis
from belt_sim.campaign import Suspicion
from belt_sim.diagnosis.decide import POLICY, Decision
from belt_sim.diagnosis.describe import _sentence
from belt_sim.effects.base import library
from belt_sim.results.diagnosis import (
    RESOLVED,
    Diagnosis,
    Explanation,
    FoundEffect,
    NextRun,
    Verdict,
)
from belt_sim.results.estimates import Estimate, MachineSizes, display_unit, number_texts
from belt_sim.show.report import (
    HERE,
    LIKELY_FROM,
    NUMBER_ROOM,
    SENSORS_ABOVE,
    plant_card,
    plant_headline,
    render,
    rival_cards,
    sketch_numbers,
    sureness,
)

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
        self.verdict, self.suspicions, self.headline = verdict, suspicions, verdict.headline


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
    unsure = plant_card(replace(TAPER, probability=LIKELY_FROM - 0.01, confusable_with=(("crown", "cant"),)))
    assert unsure["unsure"]
    (other,) = unsure["others"]
    assert other["id"] == "crown + cant"
    assert {"tail", "head"} <= {*other["parts"]}
    assert plant_headline(Said(Verdict.EXPLAINED), [unsure]).startswith("Perhaps")


def test_numbers_on_the_sketch_stand_beside_one_another():
    """Near point 4, whose name stands at 120, and at one place of the span."""
    cards = {"1": (0.04, "0.5 m"), "3": (0.05, "0.6 m"), "2": (0.95, "10.7 m")}
    numbered = [(number, {"id": "load", "parts": ("upper",), "marks": [mark]}) for number, mark in cards.items()]
    places = [x for _, x, *_ in sketch_numbers(numbered)["marks"]]
    places += SENSORS_ABOVE
    assert min(abs(a - b) for a, b in combinations(places, 2)) >= 0.99 * NUMBER_ROOM


def test_what_a_named_effect_may_be_instead_is_lettered_on_the_sketch():
    named = replace(TAPER, confusable_with=(("yaw_offset_tail",), ("side_drag",)))
    page = render(replace(drawn("nothing"), effects=(named,), tied=()))
    assert len(re.findall(r'<g class="spot other"><circle[^>]*/><text[^>]*>a</text>', page)) == 1
    assert re.search(
        r'It may instead be that <b class="letter">\(a\)</b> .*?, or that <b class="letter">\(b\)</b> ', page
    )
    assert "Letters in the sketch" in page


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
    assert camber.sizes_on(None) == ("kappa_c = 1.23 ± 0.25 mm of bow over 10 m",)


NO_POWER = 1e-3, 1e4  # as large as a number may be that is written without a power of ten


def test_every_number_of_the_library_is_readable_at_the_size_that_matters():
    for cls in library().values():
        for name, declared in cls.parameters.items():
            factor, unit = display_unit(cls.id, name, declared.unit)
            assert NO_POWER[0] <= abs(factor * declared.scale) <= NO_POWER[1], (cls.id, name, unit)


def test_a_run_that_resolves_nothing_is_not_advised():
    pair = ("taper", "crown")
    below, above = (NextRun("reverse", pair, 0.1, RESOLVED + more) for more in (-0.1, 0.1))
    assert str(below) == "No single further run on this rig tells taper from crown at the sizes that were found."
    assert "may tell taper from crown" in str(above)
    little = NextRun("reverse", pair, RESOLVED - 0.1, RESOLVED + 0.2)
    assert str(little).startswith("No single further run on this rig tells taper from crown better")
    said = replace(drawn("nothing"), next_runs=(above, below, below)).further_runs
    assert said == (str(above),)  # nothing contradicts it
    assert replace(drawn("nothing"), next_runs=(below, below)).further_runs == (str(below),)


def row(*effects, p, **more):
    return Explanation(
        effects=effects, gain=1.0, likelihood=1.0, parameters=1, occam=0.0, prior=0.0, probability=p, **more
    )


def named(effect, p):
    return FoundEffect(id=effect, numbers={}, parameters={}, probability=p)


def test_a_tie_is_told_as_one_with_a_card_for_each():
    rows = (row("taper", "cant", p=0.4), row("side_drag", "cant", p=0.35), row("cant", p=0.2, unknown=True))
    rows = (*rows, row("crown", p=0.02))
    tied = Decision(Verdict.EXPLAINED, {"cant": 1.0, "taper": 0.4}, {}, rows).tied(POLICY)
    assert [r.effects for r in tied] == [("taper",), ("side_drag",), ("something unknown",)]
    found = (named("cant", 1.0), named("taper", 0.4))
    tie = replace(drawn("nothing"), verdict=Verdict.EXPLAINED, effects=found, considered=rows, tied=tied)
    assert tie.certain_effects == ("cant",)
    page = render(tie)
    assert tie.headline == "One of three"
    assert "One of three; these runs cannot say which. Besides, most likely the axis of the tail or head" in page
    assert '<body class="partly">' in page  # amber
    assert len(re.findall(r'<div class="card[" ]', page)) == 4
    assert set(re.findall(r'<g class="spot"><circle[^>]*/><text[^>]*>(\d)', page)) == {"1", "2", "3"}  # as the cards
    for part in ("upper", "tail", "head"):
        assert re.search(rf'class="part marked" data-part="{part}"', page)
    sure = Decision(Verdict.EXPLAINED, {}, {}, (row("taper", "cant", p=0.93), *rows[1:])).tied(POLICY)
    assert replace(tie, tied=sure).headline == "Explained"


def test_of_what_all_tied_explanations_have_the_sizes_are_told_over_all_of_them(tmp_path):
    """The tapers of a tie in which the first explanation, and none of the others, has the cone at the head."""
    first, other = ({"kappa_t": size(a), "kappa_t_head": size(b)} for a, b in ((-1e-5, 5e-5), (14e-5, 0.5e-5)))
    rows = (row("taper", "side_drag", p=0.5), row("taper", "yaw_offset_tail", p=0.45), row("crown", p=0.02))
    tied = Decision(Verdict.EXPLAINED, {"taper": 1.0, "side_drag": 0.5}, {}, rows).tied(POLICY)
    cone = FoundEffect(id="taper", numbers={}, parameters=first, probability=1.0, by_explanation=(first, other))
    found = (cone, named("side_drag", 0.5))
    tie = replace(drawn("nothing"), verdict=Verdict.EXPLAINED, effects=found, considered=rows, tied=tied)
    card = plant_card(tie.effects[0])
    assert card["fault"] == "the tail or head pulley is conical"
    assert set(card["parts"]) >= {"tail", "head"}
    assert "−10.0 to 140" in card["sizes"][0]
    assert "5.00 to 50.0" in card["sizes"][1]
    assert card["sizes"][2].startswith("size and pulley not reliable")
    assert "±" not in "".join(card["sizes"])
    assert "size not reliable" in " ".join(tie.effects[0].sizes_on(None))
    sized = (replace(cone, numbers={"kappa_t": -1e-5}), replace(found[1], numbers={"moment": 1.0}))
    write_diagnosis(tmp_path, replace(tie, effects=sized))
    said = "taper + side_drag; the others, with other sizes: taper + yaw_offset_tail"
    assert said in (tmp_path / "effects.yaml").read_text(encoding="utf-8").splitlines()[0]
    alike = plant_card(replace(cone, by_explanation=(first, first)))  # the explanations agree: as if there was one
    assert alike == plant_card(replace(cone, by_explanation=()))
    assert alike["fault"] == "the head pulley is conical"


def size(value):
    return Estimate(value=value, u=1e-6, unit="1/m", plausible=True)


def test_explained_is_not_said_without_the_reservation_that_undoes_it():
    told = replace(drawn("sag_roll"), considered=(), beyond=("in 8 of 10 runs the belt is too slack",))
    assert told.headline == "Explained, with a reservation"
    assert told.lines()[1] == told.beyond[0]
    assert '<body class="partly">' in render(told)
    assert replace(told, beyond=("if friction is 0.15 or less, in 2 of 8 runs the belt slips",)).headline == "Explained"


def test_certainty_is_told_as_it_came_true():
    told = (
        "64 of 67 such answers were right in blind tests, 23 of 62 where a span had changed in a way the library lacks"
    )
    assert told in sureness(0.999)
    assert sureness(0.36).startswith("uncertain (36 %): 18 of 68 such answers")
    assert sureness(0.0).startswith("uncertain")


def test_a_cut_list_of_candidates_is_not_told_the_record_of_the_library():
    cut = replace(drawn("sag_roll"), asked_for=9)
    for card in (plant_card(cut.effects[0], asked_for=9), *rival_cards(cut)):
        assert card["sure"].endswith("of the 9 effects that were asked for")
    page = render(cut)
    assert "of the 9 effects that were asked for" in page
    assert "in blind tests" not in page


def test_another_model_that_explains_the_runs_is_no_unknown():
    instead = replace(row(p=1.0), instead="model=strip")
    told = replace(
        drawn("nothing"), verdict=Verdict.NONE_KNOWN, effects=(), considered=(instead,), tied=(),
        sentence="beam_th2 fails here, and model strip explains the difference: use model=strip.",
    )  # fmt: skip
    said = "Wrong model: beam_th2 fails here, and model strip explains the difference: use model=strip"
    assert told.lines()[0] == f"{said}."
    assert plant_headline(told, []) == said
    assert f"<h1>{said}.</h1>" in render(told)


MACHINE = MachineSizes(centre_distance=11.28, tail_radius=0.17, head_radius=0.1, width=0.2, span_length=11.28)


@pytest.mark.parametrize(
    ("effect", "number", "value", "unit", "said"),
    [
        # diameters at the two edges of a cone, and of a parabola R (1 - c y^2 / 2), worked out by hand
        ("taper", "kappa_t", 2e-5, "1/m", 1e6 * 2 * 0.17 * (math.exp(2e-5 * 0.1) - math.exp(-2e-5 * 0.1))),
        ("taper", "kappa_t_head", 2e-5, "1/m", 1e6 * 2 * 0.1 * (math.exp(2e-5 * 0.1) - math.exp(-2e-5 * 0.1))),
        ("crown", "c", 5e-3, "1/m2", 1e6 * 2 * 0.17 * 5e-3 * 0.1**2 / 2),
        ("yaw_offset_tail", "beta_0", 1e-4, "rad", 1e3 * 0.2 * math.tan(1e-4)),
        ("idler_skew", "place", 0.25, "1", 0.25 * 11.28),
    ],
)
def test_numbers_are_told_in_terms_of_the_machine(effect, number, value, unit, said):
    text = number_texts(effect, {number: Estimate(value, 0.1 * abs(value), unit, True)}, MACHINE)[number]
    assert float(text.split(" ")[0]) == pytest.approx(said, rel=0.01)


def test_a_camber_is_told_in_kelvin_and_an_edge_by_its_peak_to_peak():
    (camber,) = number_texts("camber", {"kappa_c": CAMBER}, MACHINE).values()
    assert "as 1.6 K between the edges" in camber  # 9.86e-5 * 0.2 / 12e-6
    waves = {n: Estimate(v, 1e-5, "m", True) for n, v in (("cos1", 3e-4), ("sin1", -4e-4), ("cos2", 0.0))}
    assert number_texts("edge_profile", waves) == {"peak to peak": "1.000 ± 0.020 mm"}


def test_no_effect_and_damaged_data_have_headlines_of_their_own():
    stopped = Suspicion(run="r1", signals=("y1",), kind="clipped", sentence="y1 of r1 stops at 3 mm", severity="stop")
    said = [Said(v) for v in (Verdict.ADEQUATE, Verdict.NONE_KNOWN, Verdict.CANNOT_SAY)]
    said = {plant_headline(s, []) for s in (*said, Said(Verdict.CANNOT_SAY, (stopped,)))}
    assert len(said) == 4


@pytest.mark.parametrize("likeliest", [(), ("crown",)])
def test_a_likeliest_fault_that_is_too_weak_to_name_is_still_told(likeliest):
    """Nothing is named while "nothing" keeps over 5 %; that nothing is missing is said only where it is likeliest."""
    rows = [
        Explanation(effects=e, gain=0.0, likelihood=0.0, parameters=0, occam=0.0, prior=0.0) for e in (("crown",), ())
    ]
    rows = [replace(e, probability=0.65 if e.effects == likeliest else 0.35) for e in rows]
    rows.sort(key=lambda e: -e.probability)
    found = SimpleNamespace(
        decision=Decision(Verdict.ADEQUATE, {}, {}, tuple(rows)),
        bench=SimpleNamespace(forward=SimpleNamespace(model=SimpleNamespace(name="strip"))),
        table=SimpleNamespace(visible=frozenset({"crown"})),
        search=SimpleNamespace(names=["crown"]),
    )
    told = SimpleNamespace(
        verdict=Verdict.ADEQUATE,
        tied=(),
        considered=tuple(rows),
        sentence=_sentence(found),
        beyond=(),
    )
    told.headline = Diagnosis.headline.fget(told)
    words = [told.sentence, told.headline, plant_headline(told, [])]
    assert all(("certain" in w or "crown (65 %" in w) == bool(likeliest) for w in words)
    assert ("nothing 35 %" in told.sentence) == bool(likeliest)
