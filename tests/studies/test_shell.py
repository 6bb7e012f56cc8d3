"""The shell study: what its decks say, what is read back, and, where CalculiX is installed, that it agrees."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from paper_cases import paper_case

from belt_sim.case import Rig
from belt_sim.errors import SimulationError
from studies.closed_forms import shelton_factor
from studies.paper.case import PAPER_BELT
from studies.shell import ccx, roll, span
from studies.shell.roll import Roll, roll_deck
from studies.shell.span import Mesh, layer, span_deck

COARSE = Mesh(finest=0.02, coarsest=0.3, across=2)
PARABOLA = 1e-6  # of the length of a span with a sag of 1 %
HINGED = 0.003  # of entry and carry-over: S8R shells on the mesh of the documents have 0.001
DAT = """
 displacements (vx,vy,vz) for set OUT and time  0.1000000E+01

         1  1.000000E-03 -2.000000E-03  0.000000E+00
         3  0.000000E+00  0.000000E+00  5.000000E-01

 forces (fx,fy,fz) for set DUM and time  0.1000000E+01

        12  1.000000E+01  2.000000E+00  3.000000E+00
"""

needs_ccx = pytest.mark.skipif(not ccx.is_installed(), reason=ccx.MISSING)


def sections(deck: str) -> Counter:
    return Counter(line.split(",")[0] for line in deck.splitlines() if line.startswith("*"))


def test_graded_elements_fill_the_length_and_are_finest_at_the_ends():
    steps = ccx.graded_lengths(11.28, 0.004, 0.08)
    assert steps.sum() == pytest.approx(11.28)
    assert steps[0] == steps[-1] == steps.min()
    assert steps.max() < 0.08 * 1.05
    np.testing.assert_allclose(steps, steps[::-1])


def test_quadratic_elements_have_no_node_in_their_middle():
    belt = ccx.strip([0.0, 1.0, 3.0], 0.2, 2, quadratic=True)
    assert len(belt.elements()) == 4
    assert len(belt.nodes()) == 5 * 5 - 4
    named = {int(n) for line in belt.elements() for n in line.split(",")[1:]}
    assert named == {int(line.split(",")[0]) for line in belt.nodes()}


def test_an_end_line_follows_its_dummies_and_nothing_else_is_tied():
    case = paper_case(10.0)
    hinged, held = (span_deck(case, [1.0, 2.0], ends, COARSE) for ends in ("hinged", "upper"))
    assert sections(hinged.text)["*STEP"] == 4
    belt = hinged.belt
    ties = hinged.text.split("*EQUATION")[1].split("*STEP")[0].splitlines()
    tied = {int(line.split(",")[0]) for line in ties if "," in line}
    assert tied == {belt.node(i, j) for i in (0, hinged.last) for j in range(len(belt.y))}
    assert held.first > hinged.first == 0
    length = case.rig.span_length
    for deck, expected in ((hinged, length), (held, length + 2 * layer(case))):
        free = deck.belt.x[deck.last] - deck.belt.x[deck.first]
        sag = case.sag_curvature * expected**2 / 8
        longer = 8 * (sag / expected) ** 2 / 3 - case.settings.tension / case.belt.youngs_modulus
        assert free == pytest.approx(expected * (1 + longer), rel=PARABOLA)


def test_tables_are_read_by_set_and_time(tmp_path):
    (tmp_path / "x.dat").write_text(DAT)
    shape, force = ccx.read(tmp_path / "x.dat")
    assert (shape.quantity, shape.nodes, shape.time) == ("displacements", "OUT", 1.0)
    np.testing.assert_allclose(shape.values[3], (0, 0, 0.5))
    assert force.nodes == "DUM"
    assert force.values[12][0] == 10.0
    assert ccx.read(tmp_path / "none.dat") == []


def test_without_calculix_the_word_is_clear(tmp_path, monkeypatch, capsys, configuration):
    monkeypatch.setattr(ccx.shutil, "which", lambda name: None)
    with pytest.raises(SimulationError, match=r"studies/shell/install\.sh"):
        ccx.run(tmp_path, "x", "")
    for study, name in ((span.span_study, "shell_span"), (roll.roll_study, "shell_roll")):
        study(configuration(name))
        assert capsys.readouterr().out.startswith("skipped: ccx is not installed")


def test_the_law_beside_the_shell_is_the_strips():
    case = paper_case(20.0)
    entry, carried, tilt = span.by_law(case, "hinged")
    assert entry == pytest.approx(12031, rel=1e-3)  # the figures of the shell's own table
    assert carried == pytest.approx(6514.9, rel=1e-3)
    assert tilt == pytest.approx(-18.965, rel=1e-3)


def narrow(yaw: float):
    belt = replace(PAPER_BELT, width=0.05)
    return replace(paper_case(20.0, yaw, Rig(centre_distance=1.0, head_radius=0.17, tail_radius=0.17)), belt=belt)


def test_the_rolling_beam_is_at_rest_where_the_steady_law_says():
    """Without shear and layer kappa is 0 where alpha L = Kc chord, Kc Shelton's factor, for a straight far end."""
    case = replace(narrow(0.0), belt=replace(narrow(0.0).belt, poisson_ratio=-0.9999))  # G = 5000 E: no shear
    arc, y = 0.1, 1e-4
    free = 1.0 * (1 + 20e6 / 210e9) - arc
    kl = np.sqrt(case.tension_force / case.belt.bending_stiffness) * free
    weight = 1 / shelton_factor(kl)  # y_u - y_o = L w1 theta_u seen from the far end, so theta_u = -y / (L w1)
    alpha = -y / free * weight
    kappa = roll.curvature(case, arc, y, alpha, lifts=False)
    assert kappa == pytest.approx(0.0, abs=1e-3 * abs(roll.curvature(case, arc, y, 0.0, lifts=False)))


def test_the_roll_is_configured_as_its_document_says(configuration):
    config = configuration("shell_roll")
    case, how = roll.rolling_case(config, -0.027), Roll(**config["roll"])
    assert (case.rig.span_length, case.rig.tail_radius, case.belt.width) == (1.0, 1.0, 0.05)
    assert roll.turned_by_slip(case, how.friction) < 0.02 < how.rolled


def test_the_roll_deck_lays_what_it_says():
    case, how = narrow(4e-4), Roll(rolled=0.05)
    deck, belt = roll_deck(case, how)
    assert sections(deck)["*STEP"] == 4
    assert np.diff(belt.x)[: round(0.11 / how.row) - 1] == pytest.approx(how.row)
    assert belt.x[-1] == 1.0
    assert roll.turned_by_slip(case, 3.0) == pytest.approx(10 * roll.turned_by_slip(case, 30.0))


@pytest.mark.evidence(
    "sag_roll",
    route="shell",
    what="entry moment and carry-over of one span at 10 and 40 N/mm2, {HINGED}",
)
@pytest.mark.long
@needs_ccx
@pytest.mark.parametrize("tension", [10.0, 40.0])
def test_a_span_of_shells_is_as_stiff_as_the_strip(tension, tmp_path):
    case = paper_case(tension)
    state = span.by_shell(case, [span.SMALL], "hinged", tmp_path)[0]
    np.testing.assert_allclose(state.stiffness, span.by_law(case, "hinged"), rtol=HINGED)
