"""A belt that is curved by nature: its stress-free shape, its file, and how it runs, against the strip law."""

import mujoco
import numpy as np
import pytest
from paper_cases import paper_case
from strip_bench import strip

from belt_sim.curves import late_rates
from belt_sim.effects.span import Camber, Weld
from belt_sim.errors import CannotRepresent
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.space import Options
from belt_sim.space.model import SpaceModel
from belt_sim.space.mujoco_interface import Solver, compile_model, mjcf
from belt_sim.space.scene import build_scene, tie_lengths
from studies.paper.case import ROPE_EXAMPLE

AT_REST = 1e-5  # of the deflection: what 15 s leave of its motion
LENGTHS = 1e-12  # of a chord: rounding
MOMENT = 0.01  # two links at a span's end
TILT = 0.1  # of the strip law's: landings shake a span that hardly resists tilting
NEAR = 0.03  # of y: dx = 40 mm stands for a span longer by dx
MIRRORED = 0.01  # triangles lean to one side
SHORT_AND_WIDE = 0.2  # at 10 N/mm2 the edges of a 2 m span sag unlike by 4 %, and the two spans differ by 15 %
KAPPA = 1e-3  # [1/m]: +-19 N/mm2 at the edges, under a tension of 60
WELD = Weld(angle=1e-3, at=1.0)
FINE = Options(dx=0.04, dt=2e-3, run_in=0.2, settle=0.3, acceleration=2.0)
FLEX = SpaceModel(options=FINE)
CASE = paper_case(60, 0.0, ROPE_EXAMPLE)

pytestmark = pytest.mark.filterwarnings("ignore:flex")


def rest_lengths(model):
    return np.array(model.flexedge_length0 if model.nflexedge else model.tendon_lengthspring[:, 0])


@pytest.mark.parametrize("belt", ["flex", "grid"])
@pytest.mark.parametrize("kappa", [KAPPA, -KAPPA])
def test_a_free_strip_takes_its_natural_shape(belt, kappa):
    bench = strip(belt, 2.0, camber=kappa)
    assert bench.settle(1500)[-1, :, 1].mean() == pytest.approx(0.5 * kappa * 2.0**2, rel=AT_REST)


@pytest.mark.parametrize(("belt", "across"), [("flex", 2), ("flex", 3), ("grid", 2)])
@pytest.mark.parametrize("effect", [Camber(kappa_c=KAPPA), WELD])
def test_the_ties_have_the_lengths_of_a_curved_belt(belt, across, effect):
    """Trapezoids: the outer lines turn the belt by its natural angle, and the diagonals fit the legs."""
    options = Options(dx=0.04, dt=1e-3, run_in=0.0, across=across)
    _, scene = build_scene(CASE, belt, options, SpaceModel(options=options).parts(CASE, [effect]))
    mesh, m = scene.mesh, across
    first = m * np.arange(mesh.stations)
    after = np.roll(first, -1)

    def lengths(one, other, share=1.0):
        return tie_lengths(mesh, np.stack([one, other], axis=1), share)

    outer = [lengths(first + j, after + j) for j in (0, m - 1)]
    natural = effect.angle if effect is WELD else KAPPA * mesh.chord * mesh.stations
    turned = (outer[1] - outer[0]) / (mesh.line_y[0] - mesh.line_y[-1])
    assert turned.sum() == pytest.approx(natural, rel=1e-3)  # the weld's bend is summed at 12 links
    w, legs = mesh.line_y[0] - mesh.line_y[1], [lengths(first + j, after + j) for j in (0, 1)]
    for one, other in ((first, after + 1), (after, first + 1)):
        np.testing.assert_allclose(lengths(one, other), np.sqrt(w**2 + legs[0] * legs[1]), rtol=LENGTHS)
    np.testing.assert_allclose(lengths(first, first + 1), w, rtol=LENGTHS)
    np.testing.assert_allclose(lengths(first, after, 0.0), mesh.chord, rtol=LENGTHS)


def quietly_loaded(text):
    """MuJoCo warns, in a file, of a flex that is tied to nothing."""
    warn = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        return mujoco.MjModel.from_xml_string(text)
    finally:
        mujoco.set_mju_user_warning(warn)


@pytest.mark.parametrize(("belt", "effects"), [("flex", [WELD]), ("grid", [])])
def test_the_written_file_loads_as_the_model_that_ran(belt, effects):
    options = Options(dx=0.04, dt=1e-3)
    spec, _ = build_scene(CASE, belt, options, SpaceModel(options=options).parts(CASE, effects))
    ran = compile_model(spec)
    loaded = quietly_loaded(mjcf(spec))
    for name in ("body_pos", "body_mass", "key_qpos", "flexedge_length0", "flex_stiffness", "tendon_lengthspring",
                 "tendon_stiffness", "body_inertia", "jnt_axis", "opt"):  # fmt: skip
        if name == "opt":
            assert (loaded.opt.integrator, loaded.opt.timestep) == (ran.opt.integrator, ran.opt.timestep)
        else:
            np.testing.assert_array_equal(getattr(loaded, name), getattr(ran, name), err_msg=name)
    assert loaded.nflexedge + loaded.ntendon > 0


@pytest.mark.parametrize("belt", ["flex", "grid"])
def test_camber_acts_by_its_share(belt):
    options = Options(dx=0.04, dt=1e-3, run_in=0.0)
    spec, scene = build_scene(CASE, belt, options, SpaceModel(options=options).parts(CASE, [WELD]))
    solver = Solver(compile_model(spec), scene.mesh.rest.shape)
    plain, tied = rest_lengths(solver.model), solver.tied_nodes()
    none, part, whole = (tie_lengths(scene.mesh, tied, share) for share in (0.0, 0.25, 1.0))
    np.testing.assert_allclose(none, plain, rtol=LENGTHS)
    np.testing.assert_allclose(part, 0.75 * none + 0.25 * whole, rtol=1e-9)  # diagonals are not linear in the share
    solver.set_rest_lengths(whole)
    np.testing.assert_array_equal(rest_lengths(solver.model), whole)


def test_a_rope_has_no_camber():
    with pytest.raises(CannotRepresent, match="weld: it acts through the width"):
        SpaceModel(belt="rope").run(CASE, [WELD], travel=1.0)


@pytest.mark.long
def test_uniform_camber_tilts_the_spans_and_hardly_moves_the_belt():
    curves = FLEX.run(CASE, [Camber(kappa_c=KAPPA)], travel=0.4)
    law = march_case(CASE, analytic_model("strip"), (Camber(kappa_c=KAPPA),), travel=0.4)
    np.testing.assert_allclose(curves.moment[:, -1], -CASE.belt.bending_stiffness * KAPPA, rtol=MOMENT)
    np.testing.assert_allclose(curves.tilt[:, -1], law.tilt[:, -1], rtol=TILT)
    assert np.abs(curves.y).max() < 1e-6  # a taper of this size would move it by sixty


@pytest.mark.evidence("weld", route="3d", what="y of all points as it passes, {NEAR} of the largest")
def test_a_weld_runs_through_like_in_the_strip_law():
    curves = FLEX.run(CASE, [WELD], travel=1.2)
    law = march_case(CASE, analytic_model("strip"), (WELD,), travel=1.2)
    wanted = np.stack([np.interp(curves.travel, law.travel, y) for y in law.y])
    size = np.abs(wanted).max()
    assert size > 2e-4
    np.testing.assert_allclose(curves.y, wanted, atol=NEAR * size)


@pytest.mark.long
def test_opposite_camber_is_the_mirror_image():
    both = [(Camber(kappa_c=k), Weld(angle=10.0 * k, at=1.0)) for k in (1e-4, -1e-4)]
    right, left = (FLEX.run(CASE, effects, travel=2.5) for effects in both)
    size = np.abs(right.y).max()
    assert size > 2e-4
    np.testing.assert_allclose(left.y, -right.y, atol=MIRRORED * size)
    np.testing.assert_allclose(left.tilt[:, 10:], -right.tilt[:, 10:], atol=TILT * np.abs(right.tilt).max())


@pytest.mark.evidence(
    "camber",
    route="3d",
    what="drift of a short rig at 10 N/mm2, {SHORT_AND_WIDE}; small cambers within 1 %",
)
@pytest.mark.long
def test_uniform_camber_drifts_by_the_sag():
    """At 10 N/mm2 the law says 15.8 um/m, and rope and flat beams nothing: twelve runs of the span decide."""
    case = paper_case(10, 0.0, ROPE_EXAMPLE)
    curves = SpaceModel().run(case, [Camber(kappa_c=2e-4)], travel=15.0)
    law = march_case(case, analytic_model("strip"), (Camber(kappa_c=2e-4),), travel=15.0)
    assert late_rates(curves).mean() == pytest.approx(late_rates(law).mean(), rel=SHORT_AND_WIDE)
