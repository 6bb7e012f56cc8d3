"""What every effect owes: nothing at null, the parity it declares, derivatives that are numbers, its declarations."""

from dataclasses import fields, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from paper_cases import YAW, marched, paper_case

from belt_sim.analytic.march import march, march_traced
from belt_sim.analytic.model import analytic_model
from belt_sim.effects.around_engine import indicate
from belt_sim.effects.base import HOOKS, LAWS, Effect
from belt_sim.effects.library import library
from belt_sim.laws import span as span_law
from belt_sim.laws.inside import Bend, BoundaryValues
from belt_sim.laws.runup import RunUp, State, Yaw
from belt_sim.laws.sensor import Reading
from belt_sim.laws.span import Response
from belt_sim.laws.wrap import RunOff
from belt_sim.scene_parts import SceneParts

EFFECTS = list(library().values())
IDS = [cls.id for cls in EFFECTS]
NULLS = tuple(cls.null() for cls in EFFECTS)
MODEL = analytic_model("beam_th2")
TRAVEL = 20.0  # [m]
PARITY = 1e-6  # of a contribution: what two linear marches leave; slip and play are odd by construction
ARRAYS = ("y", "angle", "moment", "edge_stress", "tilt", "sag")


def acting(cls: type[Effect]) -> Effect:
    """The effect at a strength that shows: each parameter at its scale, no two alike."""
    return cls(**{n: p.scale * (1 + 0.1 * k) for k, (n, p) in enumerate(cls.parameters.items())})


def bits(tree) -> list:
    """A tree's numbers to the last bit (0 and -0 are alike); scene parts as they are, with where the camber bends."""
    if isinstance(tree, SceneParts):
        camber = None if tree.camber is None else bits(tree.camber(np.linspace(0.0, 20.0, 99)))
        return [replace(tree, camber=None), camber]
    return [(np.asarray(x, float) + 0.0).tobytes() for x in jax.tree.leaves(tree)]


def any_arguments():
    """Arguments of every hook, of sizes as they occur, from a generator of fixed seed."""
    draw = np.random.default_rng(7)
    pair = partial(draw.normal, size=2, scale=1e-3)
    case = paper_case(10)
    names = [f.name for f in fields(State) if f.name not in ("travel", "direction", "bending")]
    now = State(
        travel=jnp.asarray(3.3), direction=jnp.asarray(1.0), bending=4.2e4, **{n: jnp.asarray(pair()) for n in names}
    )
    yaw = Yaw(
        tail=jnp.asarray(YAW), head=jnp.asarray(2e-4), roll_runup=jnp.asarray(pair()), roll_runoff=jnp.asarray(pair())
    )
    ends = jnp.asarray(draw.normal(size=(5, 2), scale=1e-2))
    held = BoundaryValues(travel=jnp.asarray(3.3), start=jnp.asarray(pair()), ends=ends, direction=jnp.asarray(1.0))
    line = jnp.linspace(0.0, 5.0, 7)
    y, tilt = jnp.asarray(draw.normal(size=(4, 7))), jnp.asarray(draw.normal(size=(2, 7)))
    reading = Reading(travel=line, true_travel=line, time=2 * line, y=y, tilt=tilt)
    return {
        "settings": (case.settings, case),
        "span": (span_law.beam_second_order(case), case),
        "hold": (
            Response(**{f.name: jnp.asarray(draw.normal(size=(2, 5))) for f in fields(Response)}),
            span_law.strip(case),
            case,
        ),
        "bend": (Bend(**{f.name: jnp.asarray(pair()) for f in fields(Bend)}), held, case),
        "yaw": (yaw, now, case),
        "runup": (RunUp(drift=jnp.asarray(pair()), turn=jnp.asarray(pair())), now, case),
        "slide": (jnp.asarray(pair()), now, case),
        "wrap": (RunOff(y=jnp.asarray(pair()), alpha=jnp.asarray(pair())), now, case),
        "scene": (SceneParts.undisturbed(case), case),
        "encoder": (line, case),
        "sensor": (reading, case),
    }


def called(effect, hook, given):
    """What a hook returns; bend is given what the effect itself works out of a span before."""
    if hook == "bend":
        bend, held, case = given
        given = (bend, held, effect.influence(span_law.strip(case), case), case)
    return getattr(effect, hook)(*given)


@pytest.mark.parametrize("cls", EFFECTS, ids=IDS)
def test_null_effect_returns_what_it_was_given(cls):
    arguments = any_arguments()
    assert set(arguments) == set(HOOKS)
    null, used = cls.null(), 0
    assert null.is_null()
    for hook, given in arguments.items():
        if getattr(cls, hook) is getattr(Effect, hook):
            continue
        used += 1
        assert bits(called(null, hook, given)) == bits(given[0]), hook
        assert bits(called(acting(cls), hook, given)) != bits(given[0]) or cls.id in ("slip", "run_up_points"), hook
    assert used, "an effect changes at least one law"


def test_march_with_all_effects_at_null_is_the_march_without_any():
    without, within = (march(paper_case(10), MODEL, e, travel=TRAVEL) for e in ((), NULLS))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(without, name), getattr(within, name), err_msg=name)


@pytest.mark.long
@pytest.mark.parametrize("model", ["rope", "beam_th1", "beam_th2", "ernst_beam", "strip"])
def test_march_with_one_effect_at_null_is_the_march_without(model):
    law = analytic_model(model)
    without = march(paper_case(10), law, travel=TRAVEL)
    for cls in EFFECTS:
        if law.refusal(cls) is None:
            within = march(paper_case(10), law, (cls.null(),), travel=TRAVEL)
            for name in ARRAYS:
                np.testing.assert_array_equal(getattr(without, name), getattr(within, name), err_msg=f"{cls.id} {name}")


@pytest.fixture(scope="module")
def contributions():
    """What each effect adds to y (4, n) at +yaw and at -yaw, as indicated [m]: {id: (plus, minus)}."""
    lanes = [NULLS] + [(*NULLS[:k], acting(cls), *NULLS[k + 1 :]) for k, cls in enumerate(EFFECTS)]
    shown = []
    for sign in (1.0, -1.0):
        case = paper_case(10, sign * YAW)
        curves = []
        for start in range(0, len(lanes), 8):
            part = lanes[start : start + 8]
            full = part + [part[0]] * (8 - len(part))
            curves += marched([case] * 8, "beam_th2", travel=TRAVEL, effects=full)[: len(part)]
        shown.append([indicate(c, case, e, np.arange(101) * 0.2).y for c, e in zip(curves, lanes, strict=True)])
    plus, minus = shown
    return {i: (plus[k + 1] - plus[0], minus[k + 1] - minus[0]) for k, i in enumerate(IDS)}


@pytest.mark.parametrize("cls", EFFECTS, ids=IDS)
def test_declared_parity_holds(cls, contributions):
    plus, minus = contributions[cls.id]
    size = np.abs(plus).max()
    assert size > 1e-9 or cls.id in ("shear", "camber"), "at its scale an effect shows"  # camber: in hanging spans
    assert cls.parity in ("odd", "even")
    wanted = -minus if cls.parity == "odd" else minus
    np.testing.assert_allclose(plus, wanted, atol=PARITY * size + 1e-15)


@pytest.mark.parametrize("effects", [NULLS, tuple(acting(c) for c in EFFECTS)], ids=["null", "acting"])
def test_derivatives_are_numbers(effects):
    case = paper_case(10)
    plan = (20, 4, 16)

    def curves(effects, tension, yaw):
        settings = replace(case.settings, tension=tension, yaw=replace(case.settings.yaw, change=yaw))
        c = march_traced(replace(case, settings=settings), effects, 8.0, model=MODEL, plan=plan)
        return c.y, c.angle, c.moment, c.tilt

    at = (jax.tree.map(jnp.asarray, effects), jnp.asarray(10e6), jnp.asarray(case.settings.yaw.change))
    scales = tuple(type(e)(**{n: jnp.asarray(p.scale) for n, p in e.parameters.items()}) for e in effects)
    along = (scales, jnp.asarray(1e5), jnp.ones(1) * 1e-4)
    _, slopes = _derivative(curves)(at, along)
    for slope in slopes:
        assert np.isfinite(slope).all()
        assert np.abs(slope).max() > 0


_KEPT: dict = {}


def _derivative(curves):
    """One compilation for both points."""
    return _KEPT.setdefault("jvp", jax.jit(lambda at, along: jax.jvp(curves, at, along)))


@pytest.mark.parametrize("cls", EFFECTS, ids=IDS)
def test_declarations_are_complete(cls):
    assert cls.law in LAWS
    assert cls.reference
    assert cls.__doc__
    for name, p in cls.parameters.items():
        low, high = p.plausible
        assert p.unit, name
        assert p.meaning, name
        assert low < high, name
        assert low <= p.scale <= high or low <= -p.scale <= high, name
        assert getattr(cls.null(), name) == p.null


def test_the_library_holds_what_a_machine_can_have():
    wanted = "sag_roll yaw_offset_tail yaw_offset_head cant taper crown wobble soft_cover slip yaw_compliance"
    wanted += " tension_bias encoder_scale sensor_gain sensor_drift edge_profile"
    assert set(wanted.split()) <= set(IDS)
