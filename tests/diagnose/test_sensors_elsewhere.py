"""Sensors inside a span and on a wrap: their readings by the laws, and a diagnosis that uses them."""

import dataclasses
from functools import partial

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from belt_sim.api.simulate import fitted_model
from belt_sim.campaign import case_of, read_campaign, write_campaign
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.samples import samples_of
from belt_sim.effects.base import library
from belt_sim.errors import BeltError
from belt_sim.units import DEGREE, N_PER_MM2
from belt_sim.virtual_rig.hidden import specified_hidden
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.march import BeltMarch, TrueErrors, true_line
from belt_sim.virtual_rig.plan import Plan, RunSetting

STRIP, BEAM_TH1, BEAM_TH2 = map(fitted_model, ("strip", "beam_th1", "beam_th2"))
YAW_AT = 2.0  # [m]
PLAN = Plan(
    runs=tuple(
        RunSetting(tension=t * N_PER_MM2, yaw=0.042 * DEGREE, direction=d, yaw_at=YAW_AT)
        for t in (10.0, 40.0)
        for d in (1, -1)
    ),
    length=25.0,
    spacing=0.1,
    signals={f"y{k}": f"point_{k}" for k in (1, 2, 3, 4)},
)
#: [m] of the readings: the march's steps of 0.1 m against linear interpolation between them
EXACT = 2e-6


def with_places(campaign, *places):
    """The campaign with a signal at each place as well, of which no reading is known."""
    more = [dataclasses.replace(campaign.signals[0], name=f"z{k}", at=at) for k, at in enumerate(places)]
    runs = [dataclasses.replace(r, signals=r.signals | {s.name: 0.0 * r.travel for s in more}) for r in campaign.runs]
    return dataclasses.replace(campaign, signals=(*campaign.signals, *more), runs=tuple(runs))


@pytest.fixture(scope="module")
def measured():
    return make_campaign(seed=1, base="strip", plan=PLAN)[0]


def shown(campaign, model, classes=(), **numbers):
    """Predicted readings, signal -> (runs, n) [m]."""
    samples = samples_of(campaign)
    forward = Forward(samples, model, classes)
    vector = forward.null()
    for k, slot in enumerate(forward.slots):
        vector[k] = numbers.get(slot.name, vector[k] * slot.scale) / slot.scale
    values = forward.values(vector[None])[0]
    return samples, {s.name: values[:, k] for k, s in enumerate(samples.signals)}


@pytest.fixture(scope="module")
def at_ends(measured):
    """Ends of spans and wraps, place -> the signal of the same point; and the campaign with sensors there and one
    3 m into the upper span: one program serves several tests."""
    case = case_of(measured, measured.runs[0])
    length, around = float(case.rig.span_length), float(case.rig.wrap_tail)
    ends = {
        "upper_span at 0 m": "y1", f"upper_span at {length} m": "y4", "lower_span at 0 m": "y2",
        f"lower_span at {length} m": "y3", "tail_wrap at 0 m": "y1", f"tail_wrap at {around} m": "y2",
        "head_wrap at 0 m": "y4", f"head_wrap at {around} m": "y3",
    }  # fmt: skip
    return ends, with_places(measured, *ends, "upper_span at 3 m")


def test_the_ends_of_spans_and_wraps_are_the_points(at_ends):
    ends, campaign = at_ends
    samples, found = shown(campaign, STRIP)
    judged = np.isfinite(samples.y[:, -1])
    for k, (place, point) in enumerate(ends.items()):
        gap = np.nanmax(np.abs(np.where(judged, found[f"z{k}"] - found[point], 0.0)))
        assert gap < EXACT, (place, gap)


def test_the_edge_of_the_belt_is_read_there_too(at_ends):
    (ends, campaign), edge = at_ends, library()["edge_profile"]
    numbers = dict.fromkeys(list(edge.parameters)[:4], 0.0001)
    _, plain = shown(campaign, STRIP, (edge,))
    _, found = shown(campaign, STRIP, (edge,), **numbers)
    for k, point in enumerate(ends.values()):
        assert np.abs(found[f"z{k}"] - plain[f"z{k}"] - found[point] + plain[point])[:, 30:].max() < EXACT
    edges = {n: found[n] - plain[n] for n in ("y1", "z8")}
    for r, ahead in ((0, 30), (1, -30)):
        one, other = edges["z8"][r], edges["y1"][r]  # the belt passes 3 m before the tail earlier, going back later
        moved = one[: len(one) - 30] - other[30:] if ahead > 0 else one[30:] - other[: len(one) - 30]
        assert np.ptp(moved) < EXACT  # but for the zero at the yaw
        assert np.ptp(one) > 1e-4


def ends(wanted, a, b):
    """How far y and y' at both ends are off those that are wanted [m, rad], in thousandths."""
    return 1e3 * (np.array([a[0], a[1], b[0], b[1]]) - wanted)


@pytest.mark.parametrize("model", [BEAM_TH1, BEAM_TH2])
def test_inside_a_span_it_is_what_the_differential_equation_says(model, measured):
    """y'''' = K^2 y'' with the positions and angles of the ends as the march has them."""
    at = 2.5
    campaign = with_places(measured, f"upper_span at {at} m")
    run = campaign.runs[0]
    case = case_of(campaign, run)
    samples, found = shown(campaign, model)
    curves = model.run(case, travel=float(run.travel[-1]))
    length = float(case.rig.span_length)
    k2 = float(case.tension_force / case.belt.bending_stiffness) if model is BEAM_TH2 else 0.0
    for s in (3.0, 10.0, 25.0):
        y1, y4 = (np.interp(s, curves.travel, curves.y[p]) for p in (0, 3))
        angle1, angle4 = (np.interp(s, curves.travel, curves.angle[p]) for p in (0, 3))

        wanted, x = np.array([y4, angle4, y1, angle1]), np.linspace(0.0, length, 60)
        bending = lambda x, u: np.stack([u[1], u[2], u[3], k2 * u[2]])  # noqa: E731
        solved = solve_bvp(bending, partial(ends, wanted), x, np.zeros((4, len(x))), tol=1e-8)
        there = found["z0"][0][np.argmin(np.abs(samples.travel[0] - s))]
        assert there == pytest.approx(float(solved.sol(length - at)[0]), abs=1e-5)


def read_inside(share: float, fault: dict) -> np.ndarray:
    """Readings (runs, n) [m] of the virtual rig's finite elements at a share of the upper span, counted from the tail.

    The rig has sensors at the points only: here its fields are read where its span stands between its ends.
    """
    faults = specified_hidden([fault], lambda: None).faults
    line = true_line(PLAN, "strip", TrueErrors())
    for one in faults:
        line = one.set(line)
    history = BeltMarch(line, faults, PLAN.length)
    travel = np.broadcast_to(PLAN.travel[:, None], (len(PLAN.travel), len(PLAN.runs)))

    def position(s):
        yaw = history.interpolate(history.yaw, s)
        ends = history.ends(history.state_at(np.stack([s, s])), history.wrap_exit(s), yaw)
        forward = line.direction > 0  # then the upper span runs to the tail, else to the head pulley
        spans = [line.span(to_tail=to_tail)[1] for to_tail in (True, False)]
        places = [np.where(forward, 1.0 - share, share) * (nodes.shape[1] - 1) for nodes in spans]
        to_tail, to_head = (
            np.stack([nodes[k, round(float(at[k])), 0] for k in range(len(at))])
            for nodes, at in zip(spans, places, strict=True)
        )
        field = np.where(forward[:, None], to_tail, to_head)  # (runs, 4): y there per unit of y and slope at the ends
        return (field.T[:, None] * np.where(forward, *ends)).sum(axis=0)

    return (position(travel) - position(np.full((1, len(PLAN.runs)), YAW_AT - 1e-6))).T


#: [m] of 3 mm: two marches of other orders, and 64 elements a span against a field in closed form
TWO_CODES = 2e-6
FAULTS = tuple(library()[name] for name in ("yaw_offset_tail", "taper"))


@pytest.mark.parametrize(
    ("effect", "numbers"),
    [("yaw_offset_tail", {"beta_0": 1e-4}), ("taper", {"kappa_t": 1e-5})],
)
def test_inside_a_span_it_is_what_the_virtual_rig_says(effect, numbers, measured):
    """Finite elements that share no code with the laws, in both directions, with a fault of a pulley."""
    share = 19 / 64  # 30 % of the span from the tail, at a node of the rig's elements
    length = float(case_of(measured, measured.runs[0]).rig.span_length)
    wanted = read_inside(share, {"id": effect, **numbers})
    samples, found = shown(with_places(measured, f"upper_span at {share * length} m"), STRIP, FAULTS, **numbers)
    judged = np.isfinite(samples.y[:, -1]).all(axis=0)
    assert np.ptp(wanted, axis=1).min() > 1e-3
    gap = (found["z0"] - wanted)[:, judged]
    assert np.ptp(gap, axis=1).max() < TWO_CODES  # where zero is aside, between two records of a march
    assert np.abs(gap).max() < 10.0 * TWO_CODES


def test_a_place_is_written_and_read_and_has_an_end(measured, tmp_path):
    folder = tmp_path / "c"
    write_campaign(with_places(measured, "upper_span at 2 m", "head_wrap at 0.1 m"), folder)
    text = (folder / "campaign.yaml").read_text()
    assert [s.at for s in read_campaign(folder).signals][4:] == ["upper_span at 2 m", "head_wrap at 0.1 m"]
    (folder / "campaign.yaml").write_text(text.replace("upper_span at 2 m", "{span: upper, distance: 2.0}"))
    assert read_campaign(folder).signals[4].at == "upper_span at 2 m"
    for wrong, says in (
        ("{span: upper, distance: 12}", "must be 0 to 11.28 m"),
        ("{span: middle, distance: 1}", "write a place by its name, or as"),
        ("{wrap: tail}", "write a place by its name, or as"),
        ("{span: upper, distance: -1}", "write a place by its name, or as"),
        ("upper_span at 1.2.3 m", "or {span: upper"),
    ):
        (folder / "campaign.yaml").write_text(text.replace("upper_span at 2 m", wrong))
        with pytest.raises(BeltError, match=says):
            read_campaign(folder)


def test_what_shapes_a_span_inside_is_refused_there(measured):
    campaign = with_places(measured, "upper_span at 2 m")
    with pytest.raises(BeltError, match="side_drag shapes the span between its ends"):
        Forward(samples_of(campaign), STRIP, (library()["side_drag"],))
    wrapped = with_places(measured, "tail_wrap at 0.1 m")
    Forward(samples_of(wrapped), STRIP, (library()["side_drag"],))  # on a wrap it may be read
