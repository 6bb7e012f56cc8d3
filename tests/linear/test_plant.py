"""The linear plant against the march (another discretisation) and against closed forms."""

import numpy as np
import pytest
from scipy.linalg import expm

import belt_sim as bs
from belt_sim.errors import CannotRepresent
from belt_sim.linear.plant import state_space

YAW = np.deg2rad(-0.042)


def _step(space, where, pushed=None):
    """y1 [m] after a step of yaw, or of what is ``pushed``, from the matrix exponential."""
    n = len(space.a)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n], system[:n, n] = space.a, space.b[:, 0] * YAW if pushed is None else pushed
    return np.array([(space.c @ expm(system * s)[:n, n])[0] for s in where])


@pytest.mark.parametrize(("model", "tension"), [("rope", 40), ("beam_th2", 10), ("strip", 7), ("strip_lift_off", 10)])
def test_a_step_of_yaw_is_that_of_the_march(model, tension):
    travel = np.array([1.0, 2.0, 5.0, 10.0])
    plant = bs.linearise(model=model, rig="test_rig", tension=tension)
    curves = bs.simulate(model=model, rig="test_rig", tension=tension, yaw=-0.042, travel=10).curves
    marched = np.interp(travel, curves.travel, curves.y[0])
    assert _step(state_space(plant, order=5, per_metre=True), travel) == pytest.approx(marched, rel=2e-4)


def test_a_plant_shows_poles_gains_and_limits():
    """The gain is the late rate of a march."""
    plant = bs.linearise(model="rope", rig="test_rig", tension=40)
    first, poles, gains, limits = repr(plant).splitlines()
    assert first.startswith("linear plant of rope, 40 N/mm2, 0.5 m/s")
    rates = bs.simulate(model="rope", rig="test_rig", tension=40, yaw=1.0, travel=400).rates
    assert gains == f"gains   late rate {rates[0] * 1e3:.4g} (yaw), {-rates[0] * 1e3:.4g} (yaw_head) mm/m per degree"
    (slow,) = (float(text.split()[0]) for text in poles.split(",")[1:] if "and" not in text)
    poles = np.linalg.eigvals(state_space(plant, order=5, per_metre=True).a)
    assert np.abs(poles - slow).min() < 1e-3
    assert limits == "limits  within those of the model"
    assert "bending_layer (3.1" in repr(bs.linearise(model="strip", rig="test_rig", tension=10))
    many = bs.linearise(model="strip", rig="test_rig", tension=[40, 20])
    assert repr(many).startswith("plants of strip at 20, 40 N/mm2")


def test_effects_are_in_the_plant():
    effects = []
    for name in ("soft_cover", "crown"):
        parameter, declared = next(iter(bs.library()[name].parameters.items()))
        effects.append({"id": name, parameter: declared.scale})
    plant = bs.linearise(model="strip", rig="test_rig", tension=20, effects=effects)
    curves = bs.simulate(model="strip", rig="test_rig", tension=20, yaw=-0.042, travel=20, effects=effects).curves
    bare = bs.simulate(model="strip", rig="test_rig", tension=20, yaw=-0.042, travel=20).curves
    y = _step(state_space(plant, order=5, per_metre=True), [20.0])[0]
    assert y == pytest.approx(curves.y[0][-1], rel=5e-4)
    assert abs(bare.y[0][-1] / y - 1) > 5e-3  # the effects are seen


@pytest.mark.parametrize(
    ("name", "numbers", "why"),
    [
        ("yaw_backlash", {"half": 1e-4}, "yaw as commanded"),
        ("edge_guide", {"stiffness": 100.0, "gap": 1e-3}, "not linear"),
        ("weld", {"angle": 1e-3, "length": 1.0}, "changes along the travel"),
        ("yaw_drift", {"rate": 1e-6}, "changes along the travel"),
        ("slip", {"inverse_friction": 6.0}, "does not slip"),
        ("sensor_gain", {"g1": 0.1}, "what a sensor shows"),
    ],
)
def test_an_effect_that_no_linear_plant_has_is_refused_by_name(name, numbers, why):
    effects = [{"id": "crown", "c": 0.01}, {"id": name, **numbers}]
    with pytest.raises(CannotRepresent, match=f"effects = {name}: .*{why}.*leave it out"):
        bs.linearise(model="strip", rig="test_rig", tension=10, effects=effects)


#: A cant acts from the start in the plant, in the march after a wrap of 0.53 m: 1.3 % of y1 at 10 m on a rope.
CANT = 0.02


@pytest.mark.parametrize(
    ("model", "effect", "tolerance"),
    [
        ("rope", {"id": "cant", "gamma": 1e-3}, CANT),
        ("strip", {"id": "cant", "gamma": 1e-3}, CANT),
        ("strip", {"id": "taper", "kappa_t": 1e-4}, 2e-4),
    ],
)
def test_a_constant_effect_is_a_constant_input(model, effect, tolerance):
    case = {"model": model, "rig": "test_rig", "tension": 10, "effects": [effect]}
    space = state_space(bs.linearise(**case), order=5, per_metre=True)
    pushed = np.pad(space.plant.constant, (0, len(space.a) - len(space.plant.constant)))
    curves = bs.simulate(**case, yaw=0, travel=10).curves
    assert _step(space, [10.0], pushed)[0] == pytest.approx(curves.y[0][-1], rel=tolerance)


def test_slow_yaw_gives_the_steady_rate():
    plant = bs.linearise(model="strip", rig="test_rig", tension=10)
    case_rate = bs.simulate(model="strip", rig="test_rig", tension=10, yaw=-0.042, travel=1).steady_rate / YAW
    k = 1e-6
    assert np.abs(plant.response([k])[0, :, 0] * k) == pytest.approx(np.full(4, abs(case_rate)), rel=1e-4)


def test_reversed_travel_mirrors_the_points():
    forward = bs.linearise(model="strip", rig="test_rig", tension=10)
    backward = bs.linearise(model="strip", rig="test_rig", tension=10, direction=-1)
    k = [0.1, 0.4]
    assert backward.response(k)[:, [1, 0, 3, 2], 0] == pytest.approx(forward.response(k)[:, :, 0])
    assert (forward.direction, backward.direction) == (1, -1)


def test_a_chain_of_lags_is_worse_than_pade_and_both_get_better():
    plant = bs.linearise(model="strip", rig="test_rig", tension=10)
    pade = [state_space(plant, order=n, per_metre=True).error(2.0) for n in (1, 2, 4)]
    chain = [state_space(plant, order=n, delay="chain", per_metre=True).error(2.0) for n in (1, 2, 4)]
    assert pade[0] > 10 * pade[1] > 100 * pade[2]
    assert chain[0] > chain[1] > chain[2] > pade[2]


def test_travel_and_time_are_one_plant():
    plant = bs.linearise(model="strip", rig="test_rig", tension=10, speed=0.25)
    slow, metres = state_space(plant), state_space(plant, per_metre=True)
    assert slow.response([0.05]) == pytest.approx(metres.response([0.2]))
    assert plant.response_in_time([0.05 / (2 * np.pi)]) == pytest.approx(plant.response([0.2]))


def test_a_schedule_meets_its_plants_and_what_lies_between():
    schedule = bs.linearise(model="strip", rig="test_rig", tension=[20, 7, 14, 10])
    there = bs.linearise(model="strip", rig="test_rig", tension=12)
    k = np.array([0.05, 0.3])
    assert schedule.plant_at(10).response(k) == pytest.approx(schedule.plants[1].response(k))
    assert np.abs(schedule.plant_at(12).response(k) / there.response(k) - 1)[:, :, 0].max() < 0.01
    with pytest.raises(bs.InputError, match="7 to 20"):
        schedule.plant_at(40)
    with pytest.raises(bs.InputError, match="at least two"):
        bs.linearise(model="strip", rig="test_rig", tension=[7, 7])


@pytest.mark.parametrize("effect", [{"id": "sensor_gain", "g1": 0.01}, {"id": "slip", "inverse_friction": 6.0}])
def test_what_a_linear_plant_cannot_do_is_said(effect):
    with pytest.raises(bs.BeltError, match=f"effects = {effect['id']}: a linear plant"):
        bs.linearise(model="strip", rig="test_rig", tension=10, effects=[effect])


def test_what_cannot_be_asked_is_said():
    plant = bs.linearise(model="strip", rig="test_rig", tension=10)
    with pytest.raises(bs.InputError, match="positive"):
        plant.response([0.0])
    with pytest.raises(bs.InputError, match="order"):
        state_space(plant, order=0)
    with pytest.raises(bs.InputError, match="pade, chain"):
        state_space(plant, delay="taylor")
