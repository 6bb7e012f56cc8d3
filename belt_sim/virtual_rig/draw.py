"""Which effects a campaign hides: as asked for, or drawn by lot."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np

from belt_sim.errors import InputError
from belt_sim.virtual_rig.dirty import DIRT
from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.library import LOT, STRANGERS, fault_class, fault_of
from belt_sim.virtual_rig.plan import Noise, Plan
from belt_sim.virtual_rig.size import Ruler, fault_of_size, scaled

#: What is hidden -> how often.
MIX = {"nothing": 0.30, "library": 0.35, "two": 0.10, "outside": 0.15, "below_noise": 0.05, "dirty": 0.05}
SIZES = (3.0, 6.0, 12.0, 24.0)  # d of one library effect
_TWO_SIZES = SIZES[1:]
_BELOW = (0.3, 1.0)
_OUTSIDE = (8.0, 24.0)
_REACHED = 0.8  # share of the wanted size that an effect must reach within its limits
_ALIKE = 3.0  # noise units that a lookalike may leave over, but no more than
_ALIKE_SHARE = 0.5  # of the effect's own size
_ATTEMPTS = 12
_NOISE_OFF, _HEAVY = 0.4, 0.10


@dataclass(frozen=True, kw_only=True)
class Hidden:
    """Faults with their sizes d (None: not measured), and what stands in ``Truth`` beside them."""

    kind: str
    faults: tuple[Fault, ...] = ()
    sizes: tuple[float | None, ...] = ()
    lookalikes: list[str] = field(default_factory=list)
    distance: float | None = None
    dirty: str | None = None


def as_asked(hidden: Sequence[str | dict], rule_of) -> Hidden:
    """Faults from ids and dictionaries; {"id": ..., "d": 12} scales to a size, which calls ``rule_of()``."""
    faults, sizes = [], []
    for spec in hidden:
        if not isinstance(spec, str | dict):
            raise InputError("hidden", spec, "", "give ids, or dictionaries with an id")
        wanted = None
        if isinstance(spec, dict) and "d" in spec:
            spec = dict(spec)
            wanted = spec.pop("d")
            if isinstance(wanted, bool) or not isinstance(wanted, int | float) or not wanted > 0:
                raise InputError("hidden d", wanted, "", "give a positive number of noise units")
        fault = fault_of(spec)
        fault, size = (fault, None) if wanted is None else fault_of_size(rule_of(), fault, float(wanted))
        faults.append(fault)
        sizes.append(size)
    kind = "stated" if faults else "nothing"
    return Hidden(kind=kind, faults=tuple(faults), sizes=tuple(sizes))


def by_lot(plan: Plan, rule_of, base: str, rng: np.random.Generator) -> Hidden:
    """One draw from the mix."""
    kind = str(rng.choice(list(MIX), p=list(MIX.values())))
    if kind == "nothing":
        return Hidden(kind=kind)
    if kind == "dirty":
        return Hidden(kind=kind, dirty=str(rng.choice(sorted(DIRT))))
    if kind == "outside":
        return _stranger(plan, rule_of(), rng)
    names = [cls.id for cls in LOT if base not in cls.part_of]
    wanted = {
        "library": lambda: [float(rng.choice(SIZES))],
        "two": lambda: [float(rng.choice(_TWO_SIZES)) for _ in range(2)],
        "below_noise": lambda: [float(rng.uniform(*_BELOW))],
    }[kind]()
    return _of_library(kind, names, wanted, plan, rule_of(), rng)


def noise_by_lot(noise: Noise, rng: np.random.Generator) -> Noise:
    """Noise up to 40 % off what is stated; one time in ten with heavy tails."""
    scale = float(rng.uniform(1 - _NOISE_OFF, 1 + _NOISE_OFF))
    return replace(noise, scale=scale, heavy_tails=bool(rng.random() < _HEAVY))


def shaped(name: str, plan: Plan, rng: np.random.Generator) -> Fault:
    """A fault of typical size with its sign, place and phase drawn."""
    cls = fault_class(name)
    sign = 1.0 if cls.positive or cls.fixed else float(rng.choice((-1.0, 1.0)))
    sizes = _sizes(cls, plan)
    if cls.mixed:
        chosen = {n: v * rng.standard_normal() for n, v in sizes.items()}
    else:
        picked = str(rng.choice(list(sizes)))
        chosen = {picked: sign * sizes[picked]}
    extras = {
        "phase": rng.uniform(0, 2 * math.pi),
        "seed": int(rng.integers(2**31)),
        "wavelength": rng.uniform(3.0, 9.0),
    }
    known = cls().parameters()
    return cls(**{n: float(v) for n, v in chosen.items()}, **{n: v for n, v in extras.items() if n in known})


def _sizes(cls: type[Fault], plan: Plan) -> dict[str, float]:
    """Typical sizes of the parameters that the plan's sensors can show."""
    return {n: s.typical for n, s in cls.sizes.items() if not s.place or s.place in plan.signals.values()}


def _of_library(kind, names, wanted, plan: Plan, rule: Ruler, rng) -> Hidden:
    """Different effects, each at its wanted size; what cannot get so large is drawn again."""
    faults: list[Fault] = []
    sizes: list[float] = []
    for size in wanted:
        for _ in range(_ATTEMPTS):
            name = str(rng.choice([n for n in names if n not in {f.id for f in faults}]))
            fault = shaped(name, plan, rng)
            if fault.fixed:
                found = float(rule.sizes([fault])[0])
            else:
                fault, found = fault_of_size(rule, fault, size)
            if found >= _REACHED * size:
                break
        faults.append(fault)
        sizes.append(found)
    alike, distance = nearest(rule, faults)
    if kind == "two":
        return Hidden(kind=kind, faults=tuple(faults), sizes=tuple(sizes), lookalikes=alike, distance=distance)
    others = [name for name in alike if name != faults[0].id]
    return Hidden(kind=kind, faults=tuple(faults), sizes=tuple(sizes), lookalikes=others)


def _stranger(plan: Plan, rule: Ruler, rng) -> Hidden:
    """An effect outside the library, scaled until the nearest library effect leaves a drawn distance over."""
    wanted = float(rng.uniform(*_OUTSIDE))
    for _ in range(_ATTEMPTS):
        fault, size = fault_of_size(rule, shaped(str(rng.choice(sorted(STRANGERS))), plan, rng), wanted)
        alike, distance = nearest(rule, [fault])
        room = min(s.limit / abs(v) for n, s in fault.sizes.items() if (v := getattr(fault, n)) != 0.0)
        if distance * min(room, 6.0) < _REACHED * wanted:
            continue
        fault = scaled(fault, min(room, wanted / distance))
        alike, distance = nearest(rule, [fault])
        size = float(rule.sizes([fault])[0])
        break
    return Hidden(kind="outside", faults=(fault,), sizes=(size,), lookalikes=alike, distance=distance)


def nearest(rule: Ruler, faults: Sequence[Fault]) -> tuple[list[str], float]:
    """Single library effects that come close to the faults' joint change, and the least that any leaves over.

    Each effect is linear about zero here, and free in all its parameters of the sensors at hand.
    """
    target = rule.reduced(np.sum(rule.changes(list(faults)), axis=0))
    left = {}
    for name, basis in _tangents(rule).items():
        fit = np.linalg.lstsq(basis, target, rcond=1e-9)[0]
        left[name] = float(np.linalg.norm(target - basis @ fit))
    allowed = min(_ALIKE, _ALIKE_SHARE * float(np.linalg.norm(target)))
    return sorted(n for n, rest in left.items() if rest < allowed), min(left.values())


@lru_cache(maxsize=1)
def _tangents(rule: Ruler) -> dict[str, np.ndarray]:
    """Library effect -> what its parameters change, reduced, shape (readings, parameters)."""
    directions = _directions(rule.plan)
    columns: dict[str, list[np.ndarray]] = {}
    for fault, change in zip(directions, rule.changes(directions), strict=True):
        columns.setdefault(fault.id, []).append(rule.reduced(change))
    return {name: np.stack(cols, axis=1) for name, cols in columns.items()}


def _directions(plan: Plan) -> list[Fault]:
    """Every library effect along each of its parameters, small; what swings, also a quarter turn later."""
    scalable = [cls for cls in LOT if not cls.fixed]
    along = [cls(**{n: v}) for cls in scalable for n, v in _sizes(cls, plan).items()]
    swinging = [f for f in along if "phase" in f.parameters()]
    return along + [replace(f, **{"phase": math.pi / 2}) for f in swinging]
