"""A found law as an ordinary effect file, which compare and diagnose accept and an engineer renames."""

import hashlib
import re
import sys
import types
from dataclasses import dataclass, field, replace

from belt_sim.discovery.effect_text import BEND, TEMPLATE, needed
from belt_sim.discovery.forms import COURSES, SHAPES, UNITS
from belt_sim.discovery.places import RELATIVE, SPAN, SPANS, TRAVEL, WRAPPED
from belt_sim.discovery.survey import Law, Term
from belt_sim.effects.base import Effect
from belt_sim.effects.library import effects_in

ID = "found_effect"
ODD = ("x", "x|x|", "x^3", "saturated", "beyond", "stuck")
_UNITS = {
    "one": "",
    "set": "",
    "sigma": "",
    "beta": "rad",
    "y": "m",
    "alpha": "rad",
    "kappa": "1/m",
    "shown": "m",
    "rate": "m/s",
}
LANDED = {
    "y": "landed.y[{}]",
    "alpha": "landed.alpha[{}]",
    "kappa": "landed.moment[{}] / case.belt.bending_stiffness",
}
_POWER = {"x|x|": 2, "x^2": 2, "x^3": 3}
_TIDY = {
    "1/m/(m)": "1/m^2",
    "1/m/(m)^2": "1/m^3",
    "1/m/(m)^3": "1/m^4",
    "m/(m)^2": "1/m",
    "m/(m)^3": "1/m^2",
    "m/(m/s)": "s",
    "rad/m": "rad/m",
    "m/m": "1",
    "m/m^2": "1/m",
    "1/m/(rad)": "1/(m rad)",
}
_LAW_OF = {
    "yaw": "drive",
    "turn": "run-up",
    "drift": "run-up",
    "shift": "wrap",
    "twist": "wrap",
    SPAN: "run-up",
    **dict.fromkeys(RELATIVE, "span"),
}


@dataclass(frozen=True)
class Number:
    """One parameter of the effect that is written: name, unit, meaning, value, and whether it only shapes."""

    name: str
    unit: str
    meaning: str
    value: float
    modifier: bool = False


@dataclass
class Written:
    """The text of an effect file, its parameters, and the class that it defines."""

    text: str
    numbers: list[Number]
    cls: type[Effect] = field(repr=False)


def written(law: Law, sizes, tension: float, *, said: str, points: dict[str, int], final: bool = False) -> Written:
    """The effect of a law with these sizes; tension: its unit [Pa]; said: for the docstring; points: signal -> row of
    its reading; final: the sizes are the parameters' defaults, so that the file alone brings the law with it.
    """
    numbers: list[Number] = []
    bodies: list[str] = []
    hooks: dict[str, list[tuple[int, Term]]] = {}
    left = list(sizes)
    for k, term in enumerate(law.terms):
        tag = "" if k == 0 else f"_{k + 1}"
        own = _numbers(term, tag, left)
        numbers += own
        bodies.append(_input(term, tag, float(tension)))
        hooks.setdefault(_hook(term), []).append((k, term))
    inputs = "\n".join(bodies)
    called = "\n".join(_HOOKS[hook](terms, points) for hook, terms in hooks.items())
    text = TEMPLATE.format(
        said=said,
        id=ID,
        law=_law(law),
        parity=parity(law),
        parameters="".join(_declared(n) for n in numbers),
        fields="".join(f"    {n.name}: float = {n.value if n.modifier or final else 0.0!r}\n" for n in numbers),
        inputs=inputs,
        hooks=called,
        **needed(inputs + called),
    )
    return Written(text, numbers, effect_of(text))


def effect_of(text: str) -> type[Effect]:
    """The effect class that the text of a file defines."""
    module = types.ModuleType(f"found_effect_{hashlib.sha256(text.encode()).hexdigest()[:16]}")
    sys.modules[module.__name__] = module
    exec(compile(text, "found_effect.py", "exec"), module.__dict__)
    return next(iter(effects_in(module).values()))


def parity(law: Law) -> str:
    """odd, even or mixed: how what the law adds changes with the sign of the yaw."""
    found = {_odd(t) for t in law.terms}
    return "mixed" if len(found) > 1 else "odd" if found.pop() else "even"


def _odd(t: Term) -> bool:
    of_motion = bool(t.place.relative) or t.place.name == TRAVEL  # in proportion to what moves or is bent
    reads = t.form.variable not in ("one", "set", "sigma")
    return (t.form.shape in ODD) != of_motion if reads else of_motion


def _law(law: Law) -> str:
    return _LAW_OF.get(law.terms[0].place.kind, "sensor")


def _hook(term: Term) -> str:
    kind = term.place.kind
    hooks = {
        "turn": "runup",
        "drift": "runup",
        "shift": "wrap",
        "twist": "wrap",
        SPAN: "runup",
        TRAVEL: "encoder",
        **dict.fromkeys(RELATIVE, "bend"),
    }
    return hooks.get(kind, kind)


def _numbers(term: Term, tag: str, sizes: list) -> list[Number]:
    form = term.form
    unit, along = size_unit(term), "s" if form.timed else "1" if form.carried else "m"
    what = f"size of {form.shape.replace('x', form.variable)} ({form.course})"
    if form.waving:
        found = [Number(f"{half}{tag}", unit, f"{what}, {half}", float(sizes.pop(0))) for half in ("cos", "sin")]
    else:
        found = [Number(f"size{tag}", unit, what, float(sizes.pop(0)))]
    if form.knee is not None:
        found.append(Number(f"knee{tag}", UNITS[form.variable], f"{form.variable} at its knee", form.knee, True))
    if form.at is not None:
        meaning = "wavelength" if form.waving else "middle of the stretch" if form.carried else "travel of its course"
        found.append(Number(f"at{tag}", along, meaning, form.at, True))
    if form.wide is not None:
        found.append(Number(f"wide{tag}", along, "how long it lasts", form.wide, True))
    found.append(Number(f"exponent{tag}", "1", "of the tension", term.exponent, True))
    return [replace(n, value=float(n.value)) for n in found]  # numpy writes its own numbers in words of numpy


def size_unit(term: Term) -> str:
    """Unit of a term's size."""
    variable, place = _UNITS[term.form.variable], term.place.unit
    power = _POWER.get(term.form.shape, 1)
    course = {"travel": "/m", "square": "/m^2", "root": "/m^0.5"}.get(term.form.course, "")
    course = course.replace("m", "s") if term.form.timed else course
    if variable == place and power == 1:
        return f"1{course}"
    over = "" if not variable else f"/({variable})^{power}" if power > 1 else f"/({variable})"
    return _TIDY.get(place + over + course, place + over + course)


def _declared(n: Number) -> str:
    size = abs(n.value) or 1.0
    if n.name.startswith("exponent"):
        low, high, size = -4.0, 4.0, 1.0
    elif n.modifier:
        low, high = n.value / 10.0, n.value * 10.0
    else:
        low, high = -10.0 * size, 10.0 * size
    null = f", null={n.value!r}, modifier=True" if n.modifier else ""
    return (
        f'        "{n.name}": Parameter(\n            unit="{n.unit or "1"}", meaning="{n.meaning}", '
        f"plausible=({low:.3g}, {high:.3g}), scale={size:.6g}{null}\n        ),\n"
    )


def _input(term: Term, tag: str, tension: float) -> str:
    """A method that gives the term's input of its variable x and of travel s."""
    form = term.form
    shape = _put(SHAPES[form.shape], f"self.knee{tag}").replace("stop(", "_stop(")

    def course(name):
        return _put(COURSES[name], f"self.at{tag}", f"self.wide{tag}")

    if form.waving:
        along = f"(self.cos{tag} * {course(form.course)} + self.sin{tag} * {course(form.sine().course)})"
    else:
        along = f"self.size{tag} * ({course(form.course)})"
    return (
        f"    def _input{tag}(self, x, s, case):\n"
        f"        slack = (case.settings.tension / {tension!r}) ** self.exponent{tag}\n"
        f"        return {along} * ({shape}) * slack\n"
    )


def _put(text: str, number: str, second: str = "") -> str:
    """A formula of the dictionary with the names of its numbers, for JAX."""
    return re.sub(r"\bq\b", second, re.sub(r"\bp\b", number, text)).replace("xp.", "jnp.")


def _x(term: Term, pulley: int | None, travel: str = "state.travel") -> str:
    v = term.form.variable
    stateless = {"one": "1.0", "set": f"_is_set(case, {travel})", "beta": f"_commanded(case, {travel})"}
    stateless["sigma"] = "case.settings.tension"
    if v in LANDED and term.place.kind in WRAPPED:  # of the belt that leaves, as it ran up
        return LANDED[v].format(pulley)
    return stateless.get(v, f"state.{v}[{pulley}]")


def _s(term: Term, travel: str = "state.travel", pulley: int | None = None) -> str:
    if term.form.carried:
        return f"_met(case, {travel})[{pulley}]"
    since = term.form.variable in ("beta", "set") and term.form.course != "wave"
    s = f"_since(case, {travel})" if since else travel
    return f"{s} / case.settings.speed" if term.form.timed else s


def _driven(terms, travel: str) -> str:
    """The sum of terms that read no state."""
    tags = ["" if k == 0 else f"_{k + 1}" for k, _ in terms]
    return " + ".join(
        f"self._input{tag}({_x(t, None, travel)}, {_s(t, travel)}, case)"
        for tag, (_, t) in zip(tags, terms, strict=True)
    )


def _calls(terms, kind_of=lambda t: True) -> list[tuple[Term, int, str]]:
    """(term, pulley, call) of every part of every term."""
    found = []
    for k, t in terms:
        tag = "" if k == 0 else f"_{k + 1}"
        for _, pulley in t.place.parts:
            call = f"self._input{tag}({_x(t, pulley)}, {_s(t, pulley=pulley)}, case)"
            if t.place.kind == SPAN:  # on the pulley that it runs up
                sign = ">" if SPANS[pulley or 0] == t.place.pulleys else "<"
                call = f"jnp.where(case.settings.direction {sign} 0.0, {call}, 0.0)"
            found.append((t, pulley, call))
    return found


def _yaw(terms, points) -> str:
    lines = "".join(
        f"        yaw = replace(yaw, {('tail', 'head')[p]}=yaw.{('tail', 'head')[p]} + {call})\n"
        for _, p, call in _calls(terms)
    )
    return f"    def yaw(self, yaw, state, case):\n{lines}        return yaw\n"


def _at_pulleys(name: str, fields: dict[str, str]):
    def hook(terms, points) -> str:
        lines = "".join(
            f"        add = jnp.zeros(2).at[{p}].set({call})\n"
            f"        {name} = replace({name}, {fields[t.place.kind]}={name}.{fields[t.place.kind]} + add)\n"
            for t, p, call in _calls(terms)
        )
        called, first = ("wrap", "        landed = runoff\n") if name == "runoff" else (name, "")
        return f"    def {called}(self, {name}, state, case):\n{first}{lines}        return {name}\n"

    return hook


def _bend(terms, points) -> str:
    shares: dict[str, list[str]] = {}
    for k, t in terms:
        tag = "" if k == 0 else f"_{k + 1}"
        bent = {"y": "boundary.start + boundary.ends[0]", "kappa": "known[0] @ boundary.ends + bend.runup"}
        x = bent.get(t.form.variable) or _x(t, None, "boundary.travel")
        s = "_met(case, boundary.travel)" if t.form.carried else _s(t, "boundary.travel")
        call = f"self._input{tag}({x}, {s}, case)"
        if t.place.pulleys in SPANS:
            first = "[True, False]" if t.place.pulleys == SPANS[0] else "[False, True]"
            call = f"jnp.where((case.settings.direction > 0) == jnp.array({first}), {call}, 0.0)"
        shares.setdefault(t.place.relative, []).append(call)
    return BEND.format(
        kinds=repr(tuple(shares)),
        shares="".join(f"            {' + '.join(calls)},\n" for calls in shares.values()),
    )


def _encoder(terms, points) -> str:
    return f"    def encoder(self, travel, case):\n        return travel + {_driven(terms, 'travel')}\n"


def _sensor(terms, points) -> str:
    lines = ""
    for k, t in terms:
        tag = "" if k == 0 else f"_{k + 1}"
        for name, _ in t.place.parts:
            row = points[name]
            read = {"shown": f"reading.y[{row}]", "rate": f"_rate(reading, {row}, case)"}
            x = read.get(t.form.variable) or _x(t, None, "reading.seen")
            call = f"self._input{tag}({x}, {_s(t, 'reading.seen')}, case)"
            lines += f"        added = added.at[{row}].add({call})\n"
    head = "    def sensor(self, reading, case):\n        added = jnp.zeros_like(reading.y)\n"
    return head + lines + "        return replace(reading, y=reading.y + added)\n"


_HOOKS = {
    "yaw": _yaw,
    "runup": _at_pulleys("runup", {"turn": "turn", "drift": "drift", SPAN: "turn"}),
    "wrap": _at_pulleys("runoff", {"shift": "y", "twist": "alpha"}),
    "bend": _bend,
    "encoder": _encoder,
    "sensor": _sensor,
}
