"""Radius at which the belt runs: taper, crown, wedge of the belt, build-up; bent axes; where a sagging span lands."""

from dataclasses import replace

import jax.numpy as jnp

from belt_sim.effects.base import CHECK_DIAMETERS, CHECK_MODEL, TURN_OVER, Cause, Effect, effect, parameter
from belt_sim.line.runup import add, sag_angle

_CONE = "ppm of the radius per m of width"
_TAPER = (1e6, _CONE)
_BULGE = "‰ of the radius 1 m from the middle"  # of R (1 - c y^2/2)


@effect
class Taper(Effect):
    """kappa_t = (dR/dy)/R turns the landing belt: dtheta_u/ds = -(kappa_u + kappa_t), towards the larger radius."""

    title = "Taper: a pulley that is a cone"
    law = "run-up"
    reference = "docs/theory.md"
    parity = "even"
    cause = Cause(
        "the {pulley} pulley is conical",
        ("tail", "head"),
        f"{CHECK_DIAMETERS} A belt that is thicker at one edge does the same on both pulleys. {TURN_OVER}",
    )
    kappa_t: float = parameter(
        "1/m", "taper of the tail pulley (+: thicker at +y)", plausible=(-1e-3, 1e-3), scale=2e-5, shop=_TAPER
    )
    kappa_t_head: float = parameter(
        "1/m", "taper of the head pulley (+: thicker at +y)", plausible=(-1e-3, 1e-3), scale=2e-5, shop=_TAPER
    )

    def runup(self, runup, state, case):
        return add(runup, turn=jnp.stack([self.kappa_t, self.kappa_t_head]))

    def scene(self, parts, case):
        return parts.add_to_pulley("tail", taper=self.kappa_t).add_to_pulley("head", taper=self.kappa_t_head)


@effect
class ThicknessWedge(Effect):
    """A belt of uneven thickness, slope = dh/dy, runs on a cone of its own: kappa_t = slope/(2 R) on each pulley.

    Its middle surface lies half its thickness above the pulley. The belt carries its taper along, and takes it to the
    other side when it is turned over.
    """

    title = "Thickness wedge: a belt that is thicker at one edge"
    law = "run-up"
    reference = "taper of the belt's middle surface on a cylinder: docs/theory.md; wedge of rolled strip"
    parity = "even"
    on_belt = True
    cause = Cause(
        "the belt is thicker at one edge", ("upper", "lower"), f"Measure the thickness at both edges. {TURN_OVER}"
    )
    slope: float = parameter(
        "1",
        "thickness per width (+: thicker at +y)",
        plausible=(-1e-4, 1e-4),
        scale=7e-6,
        shop=(1e6, "µm of thickness per m of width"),
    )

    def _tapers(self, case):
        rig = case.rig
        return self.slope / (2.0 * rig.tail_radius), self.slope / (2.0 * rig.head_radius)

    def runup(self, runup, state, case):
        return add(runup, turn=jnp.stack(self._tapers(case)))

    def scene(self, parts, case):
        tail, head = map(float, self._tapers(case))
        return parts.add_to_pulley("tail", taper=tail).add_to_pulley("head", taper=head)


@effect
class Crown(Effect):
    """R(y) = R (1 - c y^2/2): a taper kappa_t = -c y that centres the belt."""

    title = "Crown: pulleys that are thicker in the middle"
    law = "run-up"
    reference = "docs/theory.md"
    parity = "odd"
    cause = Cause("the {pulley} pulley is crowned or hollow", ("tail", "head"), CHECK_DIAMETERS)
    c: float = parameter("1/m2", "crown of the tail pulley", plausible=(-0.5, 0.5), scale=5e-3, shop=(500.0, _BULGE))
    c_head: float = parameter(
        "1/m2", "crown of the head pulley", plausible=(-0.5, 0.5), scale=5e-3, shop=(500.0, _BULGE)
    )

    def runup(self, runup, state, case):
        return add(runup, turn=-jnp.stack([self.c, self.c_head]) * (state.y + case.settings.y0))

    def scene(self, parts, case):
        y0 = float(case.settings.y0)  # the scene counts y as the march does
        for pulley, c in (("tail", self.c), ("head", self.c_head)):
            parts = parts.add_to_pulley(pulley, crown=c, taper=-c * y0)
        return parts


@effect
class PulleyDeflection(Effect):
    """The belt's pull bends both pulleys, their middle towards each other: the axis has the curvature k = compliance F.

    A shell or an axle that bends keeps its radius. At y it is yawed, so that theta_p(y) = -k y where the belt runs up
    and +k y where it leaves: a belt off the middle is steered back, the more the tighter it is. Circles y = const of a
    bent pulley are geodesics, so what lies on it keeps its y and its angle to them.
    """

    title = "Pulley deflection: shells and axles that bend under the belt's pull"
    law = "drive"
    reference = "geometry of a bent cylinder: docs/theory.md; beam between two bearings under an even load"
    parity = "odd"
    cause = Cause(
        "the pulleys bend under the belt's pull",
        ("tail", "head"),
        "Measure the bow of the shafts with the belt tensioned and slack; look for a thin shaft or a cracked shell.",
    )
    compliance: float = parameter(
        "1/(N m)",
        "curvature of both axes per unit of belt force",
        plausible=(0.0, 5e-6),
        scale=5e-7,
        shop=(1.25e8, "µm of bow over 1 m, per kN"),
    )

    def yaw(self, yaw, state, case):
        bow, y0 = self.compliance * case.tension_force, case.settings.y0
        return add(yaw, skew_runup=-bow * (state.y + y0), skew_runoff=bow * (state.y_runoff[::-1] + y0))

    def scene(self, parts, case):
        bow, y0 = self.compliance * float(case.tension_force), float(case.settings.y0)
        parts = parts.add_to_pulley("tail", bow=bow, yaw_offset=-bow * y0)
        return parts.add_to_pulley("head", bow=-bow, yaw_offset=bow * y0)


@effect
class BuildUp(Effect):
    """The tail pulley's taper grows with the belt that has passed: kappa_t = rate s, whatever the speed."""

    title = "Build-up: dirt that grows on one side of a pulley as the belt brings it"
    law = "run-up"
    reference = "docs/theory.md (taper); makers' guides: carry-back on return pulleys"
    parity = "even"
    cause = Cause(
        "dirt builds up on one side of the tail pulley", ("tail",), "Look at the tail pulley's surface, and clean it."
    )
    rate: float = parameter(
        "1/m2",
        "growth of the tail's taper with travel",
        plausible=(-1e-5, 1e-5),
        scale=4e-7,
        shop=(1e6, f"{_CONE}, per m of travel"),
    )

    def runup(self, runup, state, case):
        taper = self.rate * state.travel
        return add(runup, turn=jnp.stack([taper, 0.0 * taper]))


@effect
class RunUpPoints(Effect):
    """The span meets the pulley psi = q L/(2 F) before its top: yaw beta cos(psi), roll beta sin(psi) at the tail and
    -beta_h sin(psi) at the head pulley, where the span slopes the other way."""

    title = "Real positions of the run-up and run-off points of a sagging span"
    law = "drive"
    reference = "paper Fig. 10; docs/theory.md"
    parity = "odd"
    stage = 1  # of the yaw that the pulley really has
    cause = Cause("a sagging span meets its pulley before the top", ("tail", "head"), CHECK_MODEL, of_model=True)
    share: float = parameter("1", "share of psi that counts", plausible=(0.5, 1.5), scale=1.0, default=1.0)

    def yaw(self, yaw, state, case):
        psi = self.share * sag_angle(case)
        roll = jnp.sin(psi) * jnp.stack([yaw.tail, -yaw.head])
        turned = replace(yaw, tail=yaw.tail * jnp.cos(psi), head=yaw.head * jnp.cos(psi))
        return add(turned, roll_runup=roll, roll_runoff=roll[::-1])
