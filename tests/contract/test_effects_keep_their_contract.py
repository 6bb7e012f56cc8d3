"""What every effect owes: nothing at null, the parity it declares, derivatives that are numbers, its declarations."""

from dataclasses import fields, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from paper_cases import LANES, READ, YAW, marched, paper_case

from belt_sim.effects.base import Effect, library
from belt_sim.effects.span import SagRoll
from belt_sim.jax_setup import LEAST_EFFORT, known_options
from belt_sim.line import span as span_law
from belt_sim.line.hooks import HOOKS, LAW_NAMES, overrides, uses
from belt_sim.line.march import march_case, march_traced
from belt_sim.line.runup import Contact, Reading, RunOff, RunUp, State, Yaw
from belt_sim.line.span import Bend, BoundaryValues, Response
from belt_sim.model import analytic_model
from belt_sim.scene_parts import SceneParts

EFFECTS = list(library().values())
IDS = [cls.id for cls in EFFECTS]
NULLS = tuple(cls.null() for cls in EFFECTS)
MODEL = analytic_model("beam_th2")
TRAVEL = 20.0  # [m]
SHOWS = 1e-8  # [m], over twenty metres, where y is some millimetres; rounding is 1e-15
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
    """Arguments of every hook, of sizes as they occur, from a generator of fixed seed; moments beyond what holds."""
    draw = np.random.default_rng(7)
    pair = partial(draw.normal, size=2, scale=1e-3)
    case = paper_case(10)
    names = [f.name for f in fields(State) if f.name not in ("travel", "direction", "bending", "sag_angle")]
    now = State(
        travel=jnp.asarray(3.3),
        direction=jnp.asarray(1.0),
        bending=4.2e4,
        sag_angle=0.04,
        **{n: jnp.asarray(pair()) for n in names},
    )
    now = replace(now, moment=1e6 * now.moment, since=jnp.asarray(-1.0))  # the yaw has just been changed
    yaw = Yaw(
        **{f.name: jnp.asarray(pair()) for f in fields(Yaw)} | {"tail": jnp.asarray(YAW), "head": jnp.asarray(2e-4)}
    )
    ends = jnp.asarray(draw.normal(size=(5, 2), scale=1e-2))
    held = BoundaryValues(travel=jnp.asarray(3.3), start=jnp.asarray(pair()), ends=ends, direction=jnp.asarray(1.0))
    line = jnp.linspace(0.0, 5.0, 7)
    y, tilt = jnp.asarray(draw.normal(size=(4, 7))), jnp.asarray(draw.normal(size=(2, 7)))
    reading = Reading(travel=line, sensor_travel=line, time=2 * line, y=y, tilt=tilt)
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
        "slide": (Contact(y=jnp.asarray(pair()), alpha=jnp.asarray(pair())), now, case),
        "wrap": (RunOff(**{n: jnp.asarray(pair()) for n in ("y", "alpha", "moment")}), now, case),
        "scene": (SceneParts.from_case(case), case),
        "encoder": (line, case),
        "sensor_travel": (line, case),
        "sensor": (reading, case),
    }


@partial(jax.jit, static_argnames="hook", compiler_options=known_options(LEAST_EFFORT))
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
    for hook, given in arguments.items():
        if not overrides(cls, (hook,)):
            continue
        used += 1
        at_null, acts = (e.scene(*given) if hook == "scene" else called(e, hook, given) for e in (null, acting(cls)))
        assert bits(at_null) == bits(given[0]), hook
        assert bits(acts) != bits(given[0]), hook
    assert used, "an effect changes at least one law"


def test_march_with_all_effects_at_null_is_the_march_without_any():
    admitted = tuple(e for e in NULLS if MODEL.refusal(e) is None)
    refused = {type(e) for e in NULLS} - {type(e) for e in admitted}
    assert refused == {cls for cls in EFFECTS if "sag" in cls.needs}  # what acts through the roll of a hanging span
    without, within = (march_case(paper_case(10), MODEL, e, travel=TRAVEL) for e in ((), admitted))
    for name in ARRAYS:
        np.testing.assert_array_equal(getattr(without, name), getattr(within, name), err_msg=name)


@pytest.mark.long
@pytest.mark.parametrize("model", ["rope", "beam_th1", "beam_th2", "ernst_beam", "strip"])
def test_march_with_one_effect_at_null_is_the_march_without(model):
    law = analytic_model(model)
    without = march_case(paper_case(10), law, travel=TRAVEL)
    for cls in EFFECTS:
        if law.refusal(cls) is None:
            within = march_case(paper_case(10), law, (cls.null(),), travel=TRAVEL)
            for name in ARRAYS:
                np.testing.assert_array_equal(getattr(without, name), getattr(within, name), err_msg=f"{cls.id} {name}")


@pytest.fixture(scope="module")
def contributions():
    """What each effect adds to y (4, n) at +yaw and at -yaw, as indicated [m]: {id: (plus, minus)}."""
    shown = []
    for sign in (1.0, -1.0):
        lanes = [lane for cls in EFFECTS for lane in with_and_without(cls, sign)]
        distinct = list({(c.settings.tension, e): (c, e) for c, e in lanes}.values())
        y = {}
        for start in range(0, len(distinct), LANES):
            part = distinct[start : start + LANES]
            cases, effects = zip(*(part + [part[0]] * (LANES - len(part))), strict=True)
            curves = marched(list(cases), "beam_th2", travel=TRAVEL, effects=list(effects))
            for (case, e), c in zip(part, curves, strict=False):
                y[case.settings.tension, e] = READ(c, case, e, np.arange(101) * 0.2).y
        pairs = zip(lanes[::2], lanes[1::2], strict=True)
        shown.append([y[a.settings.tension, e] - y[b.settings.tension, f] for (a, e), (b, f) in pairs])
    return dict(zip(IDS, zip(*shown, strict=True), strict=True))


def with_and_without(cls, sign):
    """(case, effects) in which an effect acts, and the same without it: some show in spans that hang."""
    case = paper_case(10, sign * YAW)
    others = tuple(
        SagRoll(strength=1.0)
        if ("sag" in cls.needs or cls.id in ("camber", "temperature_difference")) and type(e) is SagRoll
        else e
        for e in NULLS
    )
    return (case, tuple(acting(cls) if type(e) is cls else e for e in others)), (case, others)


@pytest.mark.parametrize("cls", EFFECTS, ids=IDS)
def test_declared_parity_holds(cls, contributions):
    plus, minus = contributions[cls.id]
    size = np.abs(plus).max()
    assert size > SHOWS, "at its scale an effect shows"
    wanted = {"odd": -minus, "even": minus}[cls.parity]
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
    """One compilation for both points, which runs so seldom that little effort is spent on it."""
    march = jax.jit(lambda at, along: jax.jvp(curves, at, along), compiler_options=known_options(LEAST_EFFORT))
    return _KEPT.setdefault("jvp", march)


@pytest.mark.parametrize("cls", EFFECTS, ids=IDS)
def test_declarations_are_complete(cls):
    assert cls.law in LAW_NAMES
    assert cls.reference
    assert not cls.__doc__.startswith(f"{cls.__name__}("), "say the physics: this is what dataclass writes by itself"
    for name, p in cls.parameters.items():
        low, high = p.plausible
        assert p.unit, name
        assert p.meaning, name
        assert low < high, name
        assert low <= p.scale <= high or low <= -p.scale <= high, name
        assert getattr(cls.null(), name) == p.null
    assert cls(**{n: p.scale for n, p in cls.parameters.items()}) != cls.null()


def test_the_order_in_which_effects_are_named_does_not_matter():
    """Physics has one order: the belt's edge, gain, offset and drift; the load cell, then centrifugal tension."""
    effects, draw = [acting(cls) for cls in EFFECTS], np.random.default_rng(1)
    for hook in HOOKS:
        named = [e for e in effects if overrides(e, (hook,))]
        orders = [[e.id for e in uses([named[k] for k in draw.permutation(len(named))], hook)] for _ in range(5)]
        assert all(order == orders[0] for order in orders), hook
    sensors = [e.id for e in uses(effects[::-1], "sensor")]
    assert sensors[:2] == ["edge_profile", "sensor_gain"]
    assert [e.id for e in uses(effects[::-1], "settings")][-1] == "speed_tension"
