"""A law found in data as an effect: the class of an effect for a law that is given as data.

The terms of a law (``belt_sim.effects.law_terms``) say which hooks its class has; the hooks below evaluate them.
"""

import hashlib
from collections.abc import Sequence
from dataclasses import field, make_dataclass, replace
from functools import lru_cache
from typing import Any, ClassVar

import jax
import jax.numpy as jnp

from belt_sim.effects.base import Effect, Parameter, effect
from belt_sim.effects.belt_shape import add_natural
from belt_sim.effects.law_terms import (
    COURSES,
    PULLEYS,
    RELATIVE,
    SENSOR,
    SPAN,
    SPANS,
    TRAVEL,
    WRAPPED,
    LawNumber,
    SizedLaw,
    Term,
    law_numbers,
    number_name,
)
from belt_sim.line.influence import stretch_adds, stretch_ends, stretch_response
from belt_sim.line.runup import angle_at
from belt_sim.line.span import log_of_change, response, response_by_change

ID = "generic_law"
CLASSES = 256  # of effects that a process keeps
REACH = 0.25  # [m] of travel either way, over which a reading is differentiated
#: kind of place -> the law that an effect there changes, and the hook that changes it
_ACTS = {
    "yaw": ("drive", "yaw"),
    "turn": ("run-up", "runup"),
    "drift": ("run-up", "runup"),
    SPAN: ("run-up", "runup"),
    "shift": ("wrap", "wrap"),
    "twist": ("wrap", "wrap"),
    **dict.fromkeys(RELATIVE, ("span", "bend")),
    TRAVEL: ("sensor", "encoder"),
    SENSOR: ("sensor", "sensor"),
}


class GenericLaw(Effect):
    """Base of the effects that ``law_effect`` makes. content: the law; numbers: what its parameters stand for."""

    reference: ClassVar[str] = "found in data"
    content: ClassVar[SizedLaw]
    numbers: ClassVar[tuple[LawNumber, ...]]

    def terms(self, *kinds: str) -> list[tuple[int, Term]]:
        """Return the terms at places of these kinds, with their positions in the law."""
        return [(k, t) for k, t in enumerate(self.content.law.terms) if t.place.kind in kinds]

    def strength(self, k: int, x: Any, s: Any, case: Any) -> Any:
        """Return what the k-th term adds where its variable is x, at travel [m], time [s] or part of the belt s."""
        form = self.content.law.terms[k].form
        knee, at, wide = (getattr(self, number_name(n, k), None) for n in ("knee", "at", "wide"))
        if form.is_wave:
            cos, sin = getattr(self, number_name("cos", k)), getattr(self, number_name("sin", k))
            along = cos * form.course_value(s, jnp, at, wide) + sin * form.sine().course_value(s, jnp, at, wide)
        else:
            along = getattr(self, number_name("size", k)) * form.course_value(s, jnp, at, wide)
        return along * form.shape_value(x, s, jnp, knee) * self.tension_factor(k, case)

    def tension_factor(self, k: int, case: Any) -> Any:
        """Return (tension / reference tension)^exponent of the k-th term."""
        return (case.settings.tension / self.content.tension) ** getattr(self, number_name("exponent", k))


@lru_cache(CLASSES)
def law_effect(content: SizedLaw, id: str = ID) -> type[GenericLaw]:
    """Return the effect class of a law; the same law gives the same class, so that it is compiled once.

    Its parameters are the numbers of the law, with the law's values as defaults; sizes are null at 0.
    """
    numbers, terms = law_numbers(content), content.law.terms
    hooks = {_ACTS[t.place.kind][1]: _HOOKS[_ACTS[t.place.kind][1]] for t in terms}
    namespace = {
        "id": id,
        "title": "A law found in data: " + ", ".join(dict.fromkeys(t.place.words for t in terms)),
        "stage": 3,  # it was found beside all others
        "law": _ACTS[terms[0].place.kind][0],
        "parity": content.law.parity,
        "parameters": {n.name: _parameter(n) for n in numbers},
        "content": content,
        "numbers": numbers,
        **hooks,
        **({"influence": _influence} if "bend" in hooks else {}),
        **({"scene": _scene} if _has_geometry(terms) else {}),
    }
    # JAX tells effects apart by their names (see belt_sim.case.pytree)
    name = f"GenericLaw_{hashlib.sha256(repr((id, content)).encode()).hexdigest()[:16]}"
    fields = [(n.name, float, field(default=n.value)) for n in numbers]
    cls = make_dataclass(name, fields, bases=(GenericLaw,), namespace=namespace, frozen=True, kw_only=True)
    cls.__module__ = __name__
    made: type[GenericLaw] = effect(cls)
    return made


def _parameter(n: LawNumber) -> Parameter:
    if n.name.startswith("exponent"):
        low, high, scale = -4.0, 4.0, 1.0
    else:
        scale = abs(n.value) or 1.0
        ends = (n.value / 10.0, n.value * 10.0) if n.modifier else (-10.0 * scale, 10.0 * scale)
        low, high = min(ends), max(ends)
    null = n.value if n.modifier else 0.0
    return Parameter(unit=n.unit, meaning=n.meaning, plausible=(low, high), scale=scale, null=null, modifier=n.modifier)


# --- what a term reads ------------------------------------------------------------------------------------------------


def _commanded_yaw(case, travel):
    """The yaws of both pulleys as commanded, added up [rad], at a travel, or at travels (n,)."""

    def yaw_at(s):
        return angle_at(case.settings.yaw, s) + angle_at(case.settings.yaw_head, s)

    return jax.vmap(yaw_at)(travel) if jnp.ndim(travel) else yaw_at(travel)


def _belt_part(case, travel):
    """The part of the belt that runs up the tail and the head pulley (2,), in belt lengths from the one that is at the
    tail pulley when a forward run starts."""
    span, wrap = case.rig.span_length, case.rig.wrap_tail
    ahead, back = travel - jnp.stack([0.0 * span, span + wrap]), jnp.stack([-wrap, span]) - travel
    return jnp.where(case.settings.direction > 0, ahead, back) / case.rig.belt_length


def _rate(reading, row, case):
    """dy/dt of a reading [m/s]."""
    order = jnp.argsort(reading.sensor_travel)
    s, y = reading.sensor_travel[order], reading.y[row][order]
    low, high = (jnp.clip(reading.sensor_travel + h, s[0], s[-1]) for h in (-REACH, REACH))
    return (jnp.interp(high, s, y) - jnp.interp(low, s, y)) / (high - low) * case.settings.speed


def _independent(term: Term, travel, case):
    """The variable of a term that does not depend on where the belt runs."""
    if term.form.variable == "none":
        return 1.0
    if term.form.variable == "yaw_set":
        return jnp.where(travel >= case.settings.yaw.at[0], 1.0, 0.0)
    return _commanded_yaw(case, travel) if term.form.variable == "beta" else case.settings.tension


def _course_variable(term: Term, travel, case, pulley: int | slice | None = slice(None)):
    """What the course of a term goes with: travel [m], time [s], or the part of the belt that runs up a pulley."""
    if term.form.is_carried:
        return _belt_part(case, travel)[pulley]
    s = jnp.maximum(travel - case.settings.yaw.at[0], 0.0) if term.form.since_yaw else travel
    return s / case.settings.speed if term.form.timed else s


# --- hooks ------------------------------------------------------------------------------------------------------------


def _at_pulleys(self: GenericLaw, terms: Sequence[tuple[int, Term]], state, case, landed=None):
    """Yield (term, pulley, what it adds there); landed: the belt that leaves a pulley, as it ran up."""
    for k, t in terms:
        for _, pulley in t.place.parts:
            v = t.form.variable
            if not t.form.reads_belt:
                x = _independent(t, state.travel, case)
            elif t.place.kind not in WRAPPED:
                x = getattr(state, v)[pulley]
            else:
                x = landed.moment[pulley] / case.belt.bending_stiffness if v == "kappa" else getattr(landed, v)[pulley]
            added = self.strength(k, x, _course_variable(t, state.travel, case, pulley), case)
            if t.place.kind == SPAN:  # on the pulley that it runs up
                up = 1.0 if SPANS[pulley or 0] == t.place.where else -1.0
                added = jnp.where(case.settings.direction * up > 0.0, added, 0.0)
            yield t, pulley, added


def _yaw(self, yaw, state, case):
    for _, pulley, added in _at_pulleys(self, self.terms("yaw"), state, case):
        yaw = replace(yaw, head=yaw.head + added) if pulley else replace(yaw, tail=yaw.tail + added)
    return yaw


def _runup(self, runup, state, case):
    for t, pulley, added in _at_pulleys(self, self.terms("turn", "drift", SPAN), state, case):
        name = "drift" if t.place.kind == "drift" else "turn"
        runup = replace(runup, **{name: getattr(runup, name) + jnp.zeros(2).at[pulley].set(added)})
    return runup


def _wrap(self, runoff, state, case):
    landed = runoff
    for t, pulley, added in _at_pulleys(self, self.terms("shift", "twist"), state, case, landed):
        name = "y" if t.place.kind == "shift" else "alpha"
        runoff = replace(runoff, **{name: getattr(runoff, name) + jnp.zeros(2).at[pulley].set(added)})
    return runoff


def _influence(self, span, case):
    """Return the span's response to its boundary values, and what each change of whole spans and of a stretch of the
    belt adds, by its kind (tension, bending, torsion)."""
    whole, stretches = (
        dict.fromkeys(t.place.relative for _, t in self.terms(*RELATIVE) if t.place.is_stretch == stretch)
        for stretch in (False, True)
    )
    changes = {kind: response_by_change(span, case, kind) for kind in whole}
    return response(span), changes, {kind: stretch_response(span, kind) for kind in stretches}


def _bend(self, bend, boundary, known, case):
    answer, changes, stretches = known
    shares: dict[str, Any] = {}
    for k, t in self.terms(*RELATIVE):
        if t.place.is_stretch:
            bend = _bend_stretch(self, k, bend, boundary, stretches[t.place.relative], case)
            continue
        if t.form.variable == "y":
            x = boundary.start + boundary.ends[0]
        elif t.form.variable == "kappa":
            x = answer.runup @ boundary.ends + bend.runup
        elif t.form.variable == "kappa_mean":
            x = (boundary.ends[2] - boundary.ends[1]) / case.rig.span_length
        else:
            x = _independent(t, boundary.travel, case)
        added = self.strength(k, x, _course_variable(t, boundary.travel, case), case)
        if t.place.where in SPANS:
            first = jnp.array([t.place.where == s for s in SPANS])
            added = jnp.where((case.settings.direction > 0) == first, added, 0.0)
        elif t.place.where in PULLEYS:
            added = jnp.where(jnp.array([t.place.where == p for p in PULLEYS]), added, 0.0)
        shares[t.place.relative] = shares[t.place.relative] + added if t.place.relative in shares else added
    for kind, share in shares.items():
        x = log_of_change(share) + jnp.zeros(2)
        more = jnp.einsum("ks,kai,is->as", x ** jnp.arange(1, 8)[:, None], changes[kind], boundary.ends)
        natural = jnp.zeros((2, 2))
        if kind == "bending":  # its moment is that of its own stiffness: the rest of the curvature bears none
            natural = -jnp.expm1(x) * (jnp.stack([answer.runup, answer.runoff]) @ boundary.ends + more[:2])
        bend = add_natural(bend, more.at[:2].add(-natural), natural)
    return bend


def _bend_stretch(self, k: int, bend, boundary, response, case):
    """Add what the k-th term, the stiffness of a stretch of the belt, does to both spans."""
    size, at, wide = (getattr(self, number_name(n, k)) for n in ("size", "at", "wide"))
    jump = -size * self.tension_factor(k, case) * case.rig.span_length
    part = _belt_part(case, boundary.travel)
    behind = (at - part) * case.settings.direction
    lies = stretch_ends(case.rig.span_length, case.rig.belt_length, behind, wide)
    per_end, more = stretch_adds(response, jump, wide * case.rig.belt_length, lies)
    added = jnp.einsum("ais,is->as", per_end, boundary.ends[:3])
    if response.ends is None:
        return add_natural(bend, added, (0.0, 0.0))
    leaves = part - case.settings.direction * case.rig.span_length / case.rig.belt_length  # the part at the run-off
    here = (COURSES["belt_section"][1](place, at, wide, jnp) for place in (part, leaves))
    ends = zip(here, response.ends @ boundary.ends[:3] + added[:2], strict=True)
    return add_natural(bend, added, [more * inside * elastic for inside, elastic in ends])


def _encoder(self, travel, case):
    return travel + sum(
        self.strength(k, _independent(t, travel, case), _course_variable(t, travel, case), case)
        for k, t in self.terms(TRAVEL)
    )


def _sensor(self, reading, case):
    added = jnp.zeros_like(reading.y)
    for k, t in self.terms(SENSOR):
        for row in (point - 1 for point in t.place.points):
            if t.form.variable == "reading":
                x = reading.y[row]
            elif t.form.variable == "reading_rate":
                x = _rate(reading, row, case)
            else:
                x = _independent(t, reading.sensor_travel, case)
            added = added.at[row].add(self.strength(k, x, _course_variable(t, reading.sensor_travel, case), case))
    return replace(reading, y=reading.y + added)


def _has_geometry(terms: Sequence[Term]) -> bool:
    """Whether pulleys have a shape for every term that acts on the march: a yaw, a taper or a crown that stays."""
    acting = [t for t in terms if _ACTS[t.place.kind][0] != "sensor"]
    return bool(acting) and all(
        t.form.course == "constant"
        and (
            (t.place.kind in ("yaw", "turn") and t.form.variable in ("none", "sigma"))
            or (t.place.kind == "turn" and t.form.variable == "y" and t.form.shape == "linear")
        )
        for t in acting
    )


def _scene(self, parts, case):
    for k, t in self.terms("yaw", "turn"):
        y = t.form.variable == "y"
        value = float(self.strength(k, 1.0 if y else _independent(t, 0.0, case), 0.0, case))
        name, value = ("yaw_offset", value) if t.place.kind == "yaw" else ("crown", -value) if y else ("taper", value)
        for pulley in (PULLEYS[p or 0] for _, p in t.place.parts):
            parts = parts.add_to_pulley(pulley, **{name: value})
    return parts


_HOOKS = {"yaw": _yaw, "runup": _runup, "wrap": _wrap, "bend": _bend, "encoder": _encoder, "sensor": _sensor}
