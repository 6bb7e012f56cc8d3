"""A law as data: its curves, its file, and what is said of a file that is wrong."""

import json
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import yaml

import belt_sim as bs
from belt_sim.api.simulate import effects_of
from belt_sim.effects.generic_law import law_effect, law_entry, law_of_entry, yaml_number
from belt_sim.effects.law import COURSES, LAW_PLACES, ONE_SIDED, SHAPES, VARIABLES, Form, Law, Place, SizedLaw, Term
from belt_sim.effects.load import load_effects, save_effects
from belt_sim.errors import BeltError, CannotRepresent
from belt_sim.line.hooks import overrides
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.results.diagnosis import FoundEffect
from belt_sim.scene_parts import SceneParts

SAME = 1e-11  # [m]; of millimetres: a span is condensed to 5e-10 of its response, in other roundings by other JAX
CURVES = json.loads(
    (Path(__file__).parent / "laws_as_code.json").read_text()
)  # of the Python code once written of a law
EVERY = 50  # records
#: of what a change does in 25 m: powers stand for it, within 2 % of a span's response (test_stiffness)
BETWEEN_CHANGES = 0.06
PLACES = LAW_PLACES | {
    "sensor_y1": Place("sensor", "y1", (("y1", 1),)),
    "sensor_y4": Place("sensor", "y4", (("y4", 4),)),
    "sensor_all": Place("sensor", "all", (("y1", 1), ("y4", 4))),
}
#: law -> (place, form, exponent of the tension, sizes) of its terms
LAWS = {
    "pulleys": [
        ("yaw_tail", Form("beta", course="rise", at=8.0), -1.0, (0.02,)),
        ("yaw_both", Form("none", course="wave", at=9.0), 0.0, (1e-4, -5e-5)),
        ("yaw_head", Form("yaw_set", course="step", at=3.0), 1.0, (1e-4,)),
        ("turn_both", Form("kappa", shape="saturation", knee=1e-5), -1.0, (0.1,)),
        ("turn_tail", Form("beta", course="decaying_wave", at=9.0, wide=12.0), 0.0, (1e-3, 2e-3)),
        ("turn_head", Form("none", course="interval", at=10.0, wide=6.0), 0.0, (2e-6,)),
        ("turn_carried", Form("none", course="belt_section", at=0.8, wide=0.1), 0.0, (2e-6,)),
        ("drift_head", Form("alpha", course="step", at=12.0), 0.5, (0.1,)),
        ("drift_tail", Form("yaw_set", course="rise", at=8.0), 0.0, (1e-5,)),
        ("drift_both", Form("y", course="square_root"), 0.0, (1e-3,)),
        ("drift_carried", Form("alpha", course="belt_section", at=1.2, wide=0.1), 0.0, (0.05,)),
        ("turn_tail", Form("y", shape="signed_square"), -2.0, (0.5,)),
        ("turn_head", Form("y", shape="dead_zone", knee=5e-4), 0.0, (0.02,)),
    ],
    "wraps": [
        ("shift_tail", Form("y"), -1.0, (1e-3,)),
        ("shift_head", Form("alpha", shape="square"), 0.0, (1.0,)),
        ("shift_both", Form("none", course="linear"), 0.0, (1e-6,)),
        ("twist_both", Form("kappa", course="interval", at=10.0, wide=6.0), 0.0, (0.02,)),
        ("twist_head", Form("yaw_set", course="decay", at=20.0, timed=True), 0.0, (1e-5,)),
        ("twist_tail", Form("kappa", shape="cube"), 0.0, (1e7,)),
    ],
    "spans": [
        ("tension", Form("none", course="rise", at=10.0), -1.0, (0.1,)),
        ("pull_upper", Form("none"), 0.0, (-0.05,)),
        ("bending_both", Form("sigma", shape="below", knee=1.5e7), 0.0, (0.2,)),
        ("torsion_lower", Form("y", shape="magnitude"), 0.0, (20.0,)),
        ("bending_upper", Form("kappa", shape="magnitude_beyond", knee=1e-6), 0.0, (1e3,)),
        ("torsion_both", Form("kappa", shape="square"), 0.0, (1e8,)),
        ("bending_lower", Form("none", course="belt_section", at=0.6, wide=0.2), 0.0, (-0.1,)),
        ("pull_lower", Form("sigma", shape="above", knee=5e6), 0.0, (0.03,)),
        ("span_upper", Form("none", course="wave", at=3.0), 0.0, (2e-6, 1e-6)),
        ("span_lower", Form("none", course="quadratic", timed=True), 0.0, (1e-9,)),
    ],
    "instruments": [
        ("sensor_y1", Form("reading", shape="square"), 0.0, (5.0,)),
        ("sensor_y4", Form("reading", shape="stick", knee=2e-4), 0.0, (0.5,)),
        ("sensor_all", Form("reading_rate"), 0.0, (0.3,)),
        ("sensor_y4", Form("reading", shape="saturation", knee=1e-3), 1.0, (0.02,)),
        ("sensor_all", Form("yaw_set", course="rise", at=5.0, timed=True), 0.0, (1e-4,)),
        ("travel", Form("none", course="linear"), 0.0, (1e-3,)),
        ("travel", Form("none", course="wave", at=4.0), 0.0, (1e-2, 5e-3)),
    ],
}
TERM = "{place: yaw_tail, variable: beta, course: rise, at: 8.0, size: 0.02}"


def law_of(name: str) -> SizedLaw:
    terms = tuple(Term(PLACES[place], form, exponent) for place, form, exponent, _ in LAWS[name])
    return SizedLaw(Law(terms), tuple(size for *_, sizes in LAWS[name] for size in sizes), 1e7)


def case_of(direction: float, tension: float = 10):
    return bs.make_case(rig="test_rig", tension=tension, yaw=[{"at": 3.0, "yaw": -0.042}], direction=direction)


def curves_of(content: SizedLaw, direction: float) -> np.ndarray:
    return np.asarray(analytic_model("strip").run(case_of(direction), (law_effect(content)(),), travel=25.0).y)


@pytest.mark.parametrize("name", LAWS)
def test_a_law_does_what_the_code_once_written_of_it_did(name):
    for direction in (1, -1):
        stored = np.array(CURVES[f"{name} {direction:+d}"])
        assert np.abs(curves_of(law_of(name), direction)[:, ::EVERY] - stored).max() < SAME


def test_the_stored_laws_have_every_place_shape_course_and_variable():
    terms = [t for name in LAWS for t in law_of(name).law.terms]
    assert {t.place.kind for t in terms} == {p.kind for p in PLACES.values()}
    assert {t.form.shape for t in terms} | set(ONE_SIDED) == set(SHAPES)  # beside the virtual rig's cracks
    assert {t.form.course for t in terms} == {c for c in COURSES if not c.endswith("_sine")}
    assert {t.form.variable for t in terms} | {"kappa_mean"} == set(VARIABLES)  # the same


@pytest.mark.parametrize("name", LAWS)
def test_a_law_is_written_and_read_back(name, tmp_path):
    effect, path = law_effect(law_of(name))(), tmp_path / "found_law.yaml"
    path.write_text(save_effects([effect], {"generic_law": {"size": 1e-9}}, ["A sentence."]), encoding="utf-8")
    (read,) = load_effects([str(path)])
    assert law_entry(read) == law_entry(effect)
    assert read.parameters == effect.parameters
    assert "# A sentence." in path.read_text()
    assert type(load_effects(str(path))[0]) is type(read)  # one class a law, so that it is compiled once


def test_numbers_are_written_so_that_yaml_reads_them_back():
    for value in (1e-5, -3e22, 0.1, 1 / 3, 5.0, 1e7):
        assert yaml.safe_load(yaml_number(value)) == value


def test_a_law_with_other_numbers_is_another():
    cls = law_effect(law_of("wraps"))
    first = law_of("wraps").sizes[0]
    assert law_of_entry(law_entry(cls())) == law_of("wraps")
    assert law_of_entry(law_entry(cls(size=2.0 * first))).sizes[0] == 2.0 * first
    assert not any(getattr(cls.null(), n) for n, p in cls.parameters.items() if not p.modifier)


def test_the_yaw_is_read_along_the_readings_of_a_sensor():
    """Half of the commanded yaw, in metres, is added where the yaw was set."""
    term = Term(PLACES["sensor_y1"], Form("beta"), 0.0)
    with_law = curves_of(SizedLaw(Law((term,)), (0.5,), 1e7), 1)
    without = np.asarray(analytic_model("strip").run(case_of(1), (), travel=25.0).y)
    added = np.deg2rad(-0.042) * 0.5
    assert with_law[0, -1] - without[0, -1] == pytest.approx(added, abs=1e-9)
    assert np.array_equal(with_law[1:], without[1:])


def test_a_law_of_the_tension_moves_and_tilts_the_belt_as_that_tension_does():
    """4 N/mm2 less of 10, as a law and as the case's own tension."""
    law = SizedLaw(Law((Term(PLACES["tension"], Form("none"), 0.0),)), (-0.4,), 1e7)
    run = partial(analytic_model("strip").run, travel=25.0)
    plain, by_law, by_case = run(case_of(1)), run(case_of(1), (law_effect(law)(),)), run(case_of(1, tension=6))
    for name in ("y", "tilt"):
        change, true = (np.asarray(getattr(x, name) - getattr(plain, name)) for x in (by_law, by_case))
        assert np.abs(change - true).max() < BETWEEN_CHANGES * np.abs(true).max()


def test_laws_stand_beside_other_effects(tmp_path):
    path = tmp_path / "found_law.yaml"
    path.write_text(save_effects([law_effect(law_of("wraps"))()]), encoding="utf-8")
    effects = [{"id": "taper", "kappa_t": 1e-6}, str(path)]
    found = bs.simulate(model="strip", effects=effects, tension=10, travel=2.0)
    assert [e.id for e in found.effects] == ["taper", "generic_law"]


def test_a_3d_belt_takes_laws_of_instruments_and_refuses_the_others():
    from belt_sim.api.simulate import model_named

    space = model_named("mujoco_rope")
    assert space.refusal(law_effect(law_of("instruments"))) is None
    with pytest.raises(CannotRepresent, match="no geometry"):
        space.admit([law_effect(law_of("wraps"))()])


def test_constant_laws_of_the_pulleys_have_the_geometry_of_the_effects_that_they_are():
    forms = [("yaw_tail", "none", 1e-3), ("turn_head", "none", 2e-5), ("turn_both", "y", -0.01)]
    law = Law(tuple(Term(PLACES[place], Form(variable), 0.0) for place, variable, _ in forms))
    found = law_effect(SizedLaw(law, tuple(size for *_, size in forms), 1e7))()
    named = [
        {"id": "yaw_offset_tail", "beta_0": 1e-3},
        {"id": "taper", "kappa_t_head": 2e-5},
        {"id": "crown", "c": 0.01, "c_head": 0.01},
    ]
    case = case_of(1)
    parts = there = SceneParts.from_case(case)
    for effect in load_effects(named):
        there = effect.scene(there, case)
    assert found.scene(parts, case) == there
    later = replace(law, terms=(replace(law.terms[0], form=Form("none", course="linear")),))
    assert not overrides(law_effect(SizedLaw(later, (1e-3,), 1e7)), ("scene",))


@pytest.mark.parametrize(
    ("entry", "says"),
    [
        ("{id: generic_law}", "tension = nothing"),
        (f"{{id: generic_law, tension: -1.0, terms: [{TERM}]}}", "above 0"),
        ("{id: generic_law, tension: 1.0e+7, terms: []}", "list of terms"),
        ("{id: generic_law, tension: 1.0e+7, terms: [5]}", r"terms\[1\] = 5"),
        (f"{{id: generic_law, tension: 1.0e+7, law: 3, terms: [{TERM}]}}", "no such entry"),
        ("generic_law", "found_law.yaml"),
        (TERM.replace("yaw_tail", "yaw_tial"), "use one of yaw_tail"),
        (TERM.replace("beta", "gamma"), "use one of none"),
        (TERM.replace("beta", "reading"), "use one of none"),
        (TERM.replace("rise", "fall"), "use one of constant"),
        (TERM.replace("at: 8.0", "at: -8.0"), r"terms\[1\].at = -8.0: give a number above 0"),
        (TERM.replace("at: 8.0, ", ""), "at = nothing"),
        (TERM.replace("size", "cos"), "no such number"),
        (TERM.replace("at: 8.0", "at: 8.0, wide: 2.0"), "no such number"),
        (TERM.replace("0.02", "2e-2x"), "finite number"),
        (TERM.replace("0.02", ".nan"), "finite number"),
        (TERM.replace("0.02", "0.0"), "would do nothing"),
        (TERM.replace("0.02", "0.02, knee: 1.0"), "no such number"),
        (TERM.replace("0.02", "0.02, exponent: 50"), "at most 10"),
        (TERM.replace("0.02", "0.02, timed: later"), "true or false"),
        (TERM.replace("0.02", "0.02, points: [1]"), "only place: sensor"),
        (TERM.replace("yaw_tail", "sensor"), "give the points"),
        (TERM.replace("yaw_tail", "sensor, points: [1, 1]"), "once"),
        (TERM.replace("yaw_tail", "sensor, points: [7]"), "give the points"),
        (TERM.replace("yaw_tail", "turn_carried"), "belt_section"),
        ("{place: travel, course: belt_section, at: 0.5, wide: 0.1, size: 1.0e-6}", "met at pulleys"),
        (
            "{place: bending_carried, shape: cube, course: belt_section, at: 0.5, wide: 0.1, size: -0.3}",
            "shape = cube: bending_carried reads nothing",
        ),
        ("{place: turn_tail, variable: y, shape: stick, knee: 1.0e-3, size: 1.0}", "only the reading"),
    ],
)
def test_a_law_that_cannot_be_read_is_one_line(entry, says, tmp_path):
    if "generic_law" not in entry:
        entry = f"{{id: generic_law, tension: 1.0e+7, terms: [{entry}]}}"
    path = tmp_path / "found_law.yaml"
    path.write_text(f"schema: belt-effects/2\neffects:\n  - {entry}\n", encoding="utf-8")
    with pytest.raises(BeltError, match=says) as caught:
        load_effects(str(path))
    assert "\n" not in str(caught.value)


def test_a_law_that_a_diagnosis_names_is_taken_again():
    effect = law_effect(law_of("pulleys"))()
    found = FoundEffect(id=effect.id, numbers={}, parameters={}, probability=1.0, law=law_entry(effect))
    (taken,) = effects_of([found])
    assert law_entry(taken) == law_entry(effect)


def test_an_entry_is_plain_data():
    entry = law_entry(law_effect(law_of("spans"))())
    assert law_of_entry(json.loads(json.dumps(entry))).sizes == law_of("spans").sizes


@pytest.mark.parametrize("shares", [{"pull_tail": -0.7}, {"pull_upper": -0.7, "pull_lower": -0.4}])
def test_an_edge_has_the_stress_of_its_own_span(shares):
    """A strand at 30 % of 20 N/mm2 has 6 less what its own moments take; the tail pulley's is the upper one here."""
    law = SizedLaw(Law(tuple(Term(PLACES[place], Form("none"), 0.0) for place in shares)), tuple(shares.values()), 1e7)
    case = bs.make_case(rig="test_rig", tension=20, yaw=-0.12)
    curves = analytic_model("strip").run(case, (law_effect(law)(),), travel=10.0)
    moment = np.maximum(np.abs(curves.moment), np.abs(curves.moment_runoff))
    own = 20e6 * (1.0 + np.array([-0.7, shares.get("pull_lower", 0.0)]))
    taken = 6.0 * moment / (float(case.belt.width) ** 2 * float(case.belt.thickness))
    np.testing.assert_allclose(curves.edge_stress, own[:, None] - taken, rtol=1e-9)


@pytest.mark.parametrize(
    ("direction", "numbers", "told"),
    [
        (1, {"size": -0.45}, False),
        (1, {"size": -0.55}, True),
        (-1, {"size": -0.55}, True),
        (1, {"size": -1.0}, True),
        (1, {"place": "bending_lower", "size": 4.0}, True),
        (1, {"variable": "y", "shape": "magnitude", "size": 1e5}, True),
        (-1, {"variable": "y", "size": -1.0}, False),
        (-1, {"place": "bending_lower", "size": -0.8}, False),
        (-1, {"place": "bending_lower", "variable": "kappa", "shape": "magnitude", "size": 1e6}, True),
        (1, {"exponent": -2.0, "size": -0.2}, True),
    ],
)
def test_a_run_tells_of_a_change_that_powers_do_not_stand_for(direction, numbers, told):
    """A law with other numbers is the same program."""
    words = {n: v for n, v in numbers.items() if isinstance(v, str)}
    term = {"place": "pull_upper", "size": 1e5 if "shape" in words else 1.0} | words
    (law,) = load_effects([{"id": "generic_law", "tension": 4e7, "terms": [term]}])
    law = replace(law, **{n: v for n, v in numbers.items() if n not in words})
    run = bs.simulate(model="strip", effects=[law], tension=20, travel=2.0, yaw=-0.1, direction=direction)
    words = [x.words for x in run.beyond if x.id == "large_change"]
    assert bool(words) == told
    assert all("lower" in w if "place" in numbers else "upper" in w for w in words)


@pytest.mark.parametrize(
    ("numbers", "says"),
    [
        (
            {"at": 0.05},
            r"effects.generic_law.terms\[1\].at = 0.05 m: a wave of 0.05 m is shorter than two steps of 0.05 m",
        ),
        ({"at": 0.1, "timed": True}, r"at = 0.1 s: a wave of 0.05 m"),
        ({"course": "decaying_wave", "at": 0.09, "wide": 5.0}, "at = 0.09 m"),
    ],
)
def test_a_wave_shorter_than_two_steps_is_refused(numbers, says):
    term = {"place": "yaw_tail", "course": "wave", "cos": 1e-4, "sin": 0.0} | numbers
    law = [{"id": "generic_law", "tension": 1e7, "terms": [term]}]
    with pytest.raises(BeltError, match=says):
        bs.simulate(model="strip", tension=20, speed=0.5, travel=1.0, effects=law)


def test_a_wobble_shorter_than_two_steps_is_refused():
    small = case_of(1)
    small = replace(small, rig=replace(small.rig, tail_radius=0.1))
    with pytest.raises(BeltError, match=r"rig.tail_radius with effects.wobble = 0.1 m: a wave of 0.628 m"):
        march_case(
            small, analytic_model("strip"), load_effects([{"id": "wobble", "beta_cos": 1e-4}]), travel=1.0, step=0.32
        )
