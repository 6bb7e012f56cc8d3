"""Pulleys: the radius at which the belt runs (taper, crown, wedge, build-up), bent axes, where a sagging span lands;
contact with the belt: a soft cover, a film of air or water, lift-off along a layer, finite friction."""

from dataclasses import replace
from functools import reduce
from typing import Any

import jax.numpy as jnp

from belt_sim.effects.base import CHECK_DIAMETERS, CHECK_MODEL, TURN_OVER, Cause, Effect, effect, parameter
from belt_sim.line.runup import add, sag_angle
from belt_sim.line.span import solve_by_halves

_CONE = "ppm of the radius per m of width"
_TAPER: Any = {"plausible": (-1e-3, 1e-3), "scale": 2e-5, "shop": (1e6, _CONE)}
#: of R (1 - c y^2/2)
_CROWN: Any = {"plausible": (-0.5, 0.5), "scale": 5e-3, "shop": (500.0, "‰ of the radius 1 m from the middle")}


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
    kappa_t: float = parameter("1/m", "taper of the tail pulley (+: thicker at +y)", **_TAPER)
    kappa_t_head: float = parameter("1/m", "taper of the head pulley (+: thicker at +y)", **_TAPER)

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

    def runup(self, runup, state, case):
        tail, head = case.rig.tail_radius, case.rig.head_radius
        return add(runup, turn=jnp.stack([self.slope / (2.0 * tail), self.slope / (2.0 * head)]))

    def scene(self, parts, case):
        tail, head = (self.slope / (2.0 * float(r)) for r in (case.rig.tail_radius, case.rig.head_radius))
        return parts.add_to_pulley("tail", taper=tail).add_to_pulley("head", taper=head)


@effect
class Crown(Effect):
    """R(y) = R (1 - c y^2/2): a taper kappa_t = -c y that centres the belt."""

    title = "Crown: pulleys that are thicker in the middle"
    law = "run-up"
    reference = "docs/theory.md"
    parity = "odd"
    cause = Cause("the {pulley} pulley is crowned or hollow", ("tail", "head"), CHECK_DIAMETERS)
    c: float = parameter("1/m2", "crown of the tail pulley", **_CROWN)
    c_head: float = parameter("1/m2", "crown of the head pulley", **_CROWN)

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


# Contact of belt and pulleys.


@effect
class SoftCover(Effect):
    """The edge under more tension sinks deeper and runs on a smaller radius: extra turn c M per metre of travel."""

    title = "Soft cover, rolling-radius compliance: the belt turns under its own entry moment"
    law = "run-up"
    reference = "docs/theory.md"
    parity = "odd"
    cause = Cause(
        "a soft pulley cover gives way under one edge",
        ("tail", "head"),
        "Measure thickness and hardness of the covers.",
    )
    c: float = parameter(
        "1/(N m2)",
        "turn per metre and unit of moment",
        plausible=(0.0, 2e-4),
        scale=5e-6,
        shop=(1e6, "mm/m per m and kN m"),
    )

    def runup(self, runup, state, case):
        return add(runup, turn=self.c * state.moment)


@effect
class TractionLoss(Effect):
    """A belt that half floats climbs sideways by a share of its contact angle: dy/ds = -(1 - loss (v - onset)) alpha.

    Below ``onset`` nothing is lost. Rates of one tension and yaw that differ with speed and nothing else give it away.
    """

    title = "Traction lost above a speed: a film of air or liquid between belt and pulley"
    law = "run-up"
    reference = "Knox and Sweeney 1971 (Ind. Eng. Chem. Process Des. Dev. 10(2) 201), air films; here linear"
    parity = "odd"
    tension_exponent = 0.0
    cause = Cause(
        "the belt floats on a film of air or liquid at speed",
        ("tail", "head"),
        "Look for water at the run-ups, and repeat a run slowly.",
    )
    loss: float = parameter(
        "s/m", "share lost per unit of speed", plausible=(0.0, 2.0), scale=0.1, shop=(100.0, "% per m/s")
    )
    onset: float = parameter(
        "m/s",
        "speed at which it begins",
        plausible=(0.0, 20.0),
        scale=0.1,
        modifier=True,
        grid=(0.0, 0.1, 0.25, 0.5, 1.0, 2.0, 5.0),
    )

    def runup(self, runup, state, case):
        share = jnp.clip(self.loss * (case.settings.speed - self.onset), 0.0, 1.0)
        return add(runup, drift=share * state.alpha)


@effect
class LiftOff(Effect):
    """Steel of thickness h straightens over l = sqrt(D/(sigma h)) beside the tangent point, D its plate stiffness.

    A fibre under more tension has a shorter layer and lies lower there. A belt with an in-plane moment M so tilts where
    it leaves the pulley, phi = s H M/T with H = (l^2/R)/(1 + r) and r^2 = F b^2/(12 T), and leaves it at
    y' = theta -+ (l^3/2R^2)/(1 + r)^2 M/T + s H phi' (- at the run-up, + at the run-off; s = +1 upper, -1 lower span;
    the last term by reciprocity). docs/theory.md derives it.

    ``strength`` multiplies l^2 and l^3; 1 is a steel belt, nothing is fitted. What cambers, welds and guides add
    between the ends is not felt by the layer.
    """

    title = "Lift-off: a belt that resists bending leaves its pulley along a layer, fibre by fibre at different heights"
    law = "run-up"
    reference = "plate under tension on a cylinder, any textbook; checked against shell elements on cylinders"
    parity = "odd"
    cause = Cause("the belt leaves its pulleys along a layer", ("tail", "head"), CHECK_MODEL, of_model=True)
    strength: float = parameter(
        "1", "share of the bending layer that acts", plausible=(0.5, 1.5), scale=1.0, default=1.0
    )

    def hold(self, answer, span, case):
        layer = jnp.sqrt(case.belt.plate_stiffness / (case.settings.tension * case.belt.thickness))
        tail, head = case.rig.tail_radius, case.rig.head_radius
        runup, runoff = jnp.stack([tail, head]), jnp.stack([head, tail])
        side = case.settings.direction * jnp.array([1.0, -1.0])
        share = 1.0 + jnp.sqrt(case.tension_force * case.belt.width**2 / (12.0 * span.torsion))
        lift = [self.strength * side * layer**2 / (share * r) for r in (runup, runoff)]
        lean = [self.strength * layer**3 / (2.0 * (share * r) ** 2) for r in (runup, runoff)]
        moment = span.bending / span.torsion  # M/T per unit of curvature
        # outputs kappa and phi' at run-up and run-off -> what they add to the boundary values
        back = jnp.zeros((2, 5, 4))
        back = back.at[:, 2, 0].set(-lean[0] * moment).at[:, 2, 2].set(lift[0])  # theta at the run-up
        back = back.at[:, 1, 1].set(lean[1] * moment).at[:, 1, 3].set(lift[1])  # theta at the run-off
        back = back.at[:, 4, 0].set(lift[0] * moment).at[:, 3, 1].set(lift[1] * moment)  # phi at either
        out = jnp.stack([answer.runup, answer.runoff, answer.twist_runup, answer.twist_runoff], axis=1)
        loop = out @ back
        more = solve_by_halves(jnp.eye(4) - loop, loop @ out)
        added = back @ (out + more)  # to the boundary values, per unit of what the pulleys give
        rows = dict(zip(("runup", "runoff", "twist_runup", "twist_runoff"), more.swapaxes(0, 1), strict=True))
        return add(answer, **rows, mid_tilt=jnp.einsum("sd,sde->se", answer.mid_tilt, added))

    def scene(self, parts, case):
        return add(parts, lift_off=self.strength)


_ASIDE = 0.3  # of turn times zone: how far the end of a zone goes aside
_FAR, _NEAR = 0.067, 0.484  # of the side force in a zone: its length to 3 % up to z = 14 b


@effect
class Slip(Effect):
    """A step M of the belt's moment at the end of a wrap is taken up by friction on a zone of the wrap, which slides.

    Turning a wrapped belt meets at most mu F b/4R newton metres per metre, so that M would fade over
    z = 4 R M/(mu F b); a long zone goes aside as well, which meets mu F/R newtons per metre, and is shorter:
    z (1 + 0.067 x)/(1 + 0.484 x) with x = z/b. The end of the wrap turns by the curvature left there, M zone/2EI, and
    goes aside by 0.3 of turn times zone. M is what is left once it has turned, M_0 - EI k turn (k = dkappa/dtheta at
    that end of the span). A zone ends with the wrap. Given as 1/mu, so that 0 is perfect sticking.

    Where the belt runs up this happens once at each change of yaw, and at travel 0 for whatever bends the span from
    then on (a yaw offset, a load): the span bends, the belt on the pulley not yet. A change over ``over`` metres lands
    belt bent already, and turns it by M (zone - over)/2EI or not at all. Then the belt lands as bent as its span and
    sticks. Where it leaves, sliding goes on for good: the belt comes as bent as it landed and leaves as bent as the
    next span wants it; M is the difference.
    """

    title = "Finite friction: the belt turns on a pulley at a change of yaw, and wherever it leaves one"
    law = "run-up"
    reference = "Coulomb friction of a wrap; zones solved in tests/agreement/test_slip.py, 3D belt with friction"
    parity = "odd"
    stage = 1  # after a cant has moved the belt round the pulley
    cause = Cause(
        "the belt turns on its pulleys where it should stick",
        ("tail", "head"),
        "Look for grease, water or dust on the pulleys.",
    )
    inverse_friction: float = parameter("1", "1/mu of belt on pulley", plausible=(1.0, 20.0), scale=6.0)

    def slide(self, contact, state, case):
        held, zone = self._zone(state.moment, state.stiffness, case)
        begins = jnp.where((state.since < 0.0) & (state.travel >= 0.0), zone, 0.0)
        ends = []  # lengths on which the belt slides where it runs up, if a change of yaw has just ended
        for yaw in (case.settings.yaw, case.settings.yaw_head):
            end = yaw.at + yaw.over
            ended = (yaw.change != 0.0) & (end > state.since) & (end <= state.travel)
            ends.append(jnp.max(jnp.where(ended, jnp.maximum(zone[:, None] - yaw.over, 0.0), 0.0), axis=1))
        turned = held * reduce(jnp.maximum, ends, begins) / (2.0 * state.bending)
        return add(contact, y=_ASIDE * turned * zone, alpha=-turned)

    def wrap(self, runoff, state, case):
        stuck = (state.moment_runoff + state.bending * state.stiffness * state.left)[::-1]
        held, zone = self._zone(stuck - runoff.moment, state.stiffness[::-1], case)
        turned = held * zone / (2.0 * state.bending)
        return add(runoff, y=_ASIDE * turned * zone, alpha=turned, turned=turned)

    def _zone(self, moment, stiffness, case):
        """What is left of a step of moment [N m] once the belt has turned, and the length [m] on which it slides; shape
        (2,), tail and head pulley."""
        rig, width = case.rig, case.belt.width
        radius, wrap = jnp.stack([rig.tail_radius, rig.head_radius]), jnp.stack([rig.wrap_tail, rig.wrap_head])
        whole = 4.0 * radius * self.inverse_friction * jnp.abs(moment) / (case.tension_force * width**2)
        gives = 0.5 * stiffness * width * whole * with_side_force(whole)
        x = whole * (1.0 + 2.0 * gives) / (1.0 + 3.0 * gives + gives**2)  # of x (1 + gives x/whole) = whole, to 1 %
        zone = jnp.minimum(width * x * with_side_force(x), wrap)
        return moment / (1.0 + 0.5 * stiffness * zone), zone

    def scene(self, parts, case):
        return replace(parts, friction=1.0 / self.inverse_friction) if self.inverse_friction > 0 else parts


def with_side_force(x):
    """Of the zone that there would be without side force, which has x widths."""
    return (1.0 + _FAR * x) / (1.0 + _NEAR * x)
