"""Which effects a campaign hides: as specified, or drawn at random."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.errors import InputError, finite
from belt_sim.virtual_rig.effect_size import (
    Detectability,
    LibraryDistance,
    LibrarySignatures,
    largest_scale,
    scale_fault,
    scale_to_size,
    visible_sizes,
)
from belt_sim.virtual_rig.fault import Fault
from belt_sim.virtual_rig.library import BLIND, DEVELOPMENT, RANDOM_LIBRARY, UNMODELLED, fault_class, fault_from_spec
from belt_sim.virtual_rig.plan import Noise, Plan

#: What is hidden -> how often.
MIX = {"nothing": 0.30, "library": 0.35, "two": 0.10, "outside": 0.15, "below_noise": 0.05, "dirty": 0.05}
SIZES = (3.0, 6.0, 12.0, 24.0)  # d of one library effect
OUTSIDE = (6.0, 30.0)  # what the best three library effects leave over of an unmodelled fault
#: In this share of the sets of two, and of unmodelled faults, one more thing is a real belt's edge.
EDGE_BESIDE = {"two": 0.3, "outside": 0.1}
_TWO_SIZES = SIZES[1:]
_BELOW = (0.3, 1.0)
_EDGE = (0.2, 1.0)  # share of the measured profile
REACHED = 0.8  # share of the wanted size that an effect must reach within its limits
_MOST = 400.0  # noise units: an unmodelled fault that needs more to stand out from the library is drawn again
_FAR = 0.05  # [m]: what moves a belt further is no fault that is measured, but one that is seen
_ATTEMPTS = 8
_NOISE_OFF, _HEAVY = 0.4, 0.10


@dataclass(frozen=True, kw_only=True)
class HiddenFaults:
    """Faults with their sizes d (None: not measured), and what stands in ``Truth`` beside them."""

    kind: str
    faults: tuple[Fault, ...] = ()
    sizes: tuple[float | None, ...] = ()
    lookalikes: list[str] = field(default_factory=list)
    distance: float | None = None
    dirty: str | None = None


def specified_hidden(hidden: Sequence[str | dict], get_detectability: Callable[[], Detectability]) -> HiddenFaults:
    """Faults from ids and dictionaries; {"id": ..., "d": 12} scales to a size, which calls ``get_detectability()``."""
    if isinstance(hidden, str) or not isinstance(hidden, Sequence):
        raise InputError("hidden", hidden, "", "give a list of ids, or of dictionaries with an id")
    faults, sizes = [], []
    for spec in hidden:
        if not isinstance(spec, str | dict):
            raise InputError("hidden", spec, "", "give ids, or dictionaries with an id")
        wanted = None
        if isinstance(spec, dict) and "d" in spec:
            spec = dict(spec)
            wanted = finite("hidden d", spec.pop("d"), "", "give a positive number of noise units", lambda d: d > 0)
        fault = fault_from_spec(spec)
        fault, size = (fault, None) if wanted is None else scale_to_size(get_detectability(), fault, wanted)
        faults.append(fault)
        sizes.append(size)
    kind = "stated" if faults else "nothing"
    return HiddenFaults(kind=kind, faults=tuple(faults), sizes=tuple(sizes))


def random_hidden(
    plan: Plan,
    get_detectability: Callable[[], Detectability],
    base: str,
    rng: np.random.Generator,
    *,
    kind: str | None = None,
    unmodelled: Sequence[str] = BLIND + DEVELOPMENT,
    library: Sequence[str] = (),
) -> HiddenFaults:
    """One draw from the mix, or of one kind; unmodelled, library: ids that are drawn from (library: () = all)."""
    kind = kind or str(rng.choice(list(MIX), p=list(MIX.values())))
    if kind == "nothing":
        return HiddenFaults(kind=kind)
    if kind == "dirty":
        able = sorted(name for name in CORRUPTIONS if len(plan.signals) > 1 or name not in NEEDS_TWO)
        return HiddenFaults(kind=kind, dirty=str(rng.choice(able)))
    if kind == "outside":
        acting = tuple(name for name in unmodelled if base not in UNMODELLED[name].idle_on)
        return _draw_unmodelled(plan, LibrarySignatures(get_detectability()), acting, rng)
    names = [cls.id for cls in RANDOM_LIBRARY if base not in (*cls.part_of, *cls.idle_on)]
    names = [name for name in names if not library or name in library]
    wanted = {
        "library": lambda: [float(rng.choice(SIZES))],
        "two": lambda: [float(rng.choice(_TWO_SIZES)) for _ in range(2)],
        "below_noise": lambda: [float(rng.uniform(*_BELOW))],
    }[kind]()
    return _draw_library(kind, names, wanted, plan, LibrarySignatures(get_detectability()), rng)


def random_noise(noise: Noise, rng: np.random.Generator) -> Noise:
    """Noise up to 40 % off what is stated; one time in ten with heavy tails."""
    scale = float(rng.uniform(1 - _NOISE_OFF, 1 + _NOISE_OFF))
    return replace(noise, scale=scale, heavy_tails=bool(rng.random() < _HEAVY))


def random_fault(name: str, plan: Plan, rng: np.random.Generator) -> Fault:
    """A fault of typical size with its sign, place and phase drawn."""
    cls = fault_class(name)
    sign = 1.0 if cls.positive or cls.fixed else float(rng.choice((-1.0, 1.0)))
    sizes = visible_sizes(cls, plan)
    if not sizes:
        raise InputError("hidden", name, "", "needs a lateral sensor, which the plan has not")
    if cls.mixed:
        chosen = {n: float(s.typical * rng.standard_normal()) for n, s in sizes.items()}
    else:
        picked = str(rng.choice(list(sizes)))
        chosen = {picked: sign * sizes[picked].typical}
    return cls(**chosen, **cls.random_shape(plan, rng))


def _draw_library(kind, names, wanted, plan: Plan, library: LibrarySignatures, rng) -> HiddenFaults:
    """Different effects, each at its wanted size; what cannot get so large is drawn again."""
    faults: list[Fault] = []
    sizes: list[float] = []
    detectability = library.detectability
    edge = kind == "two" and rng.random() < EDGE_BESIDE[kind]
    for number, size in enumerate(wanted):
        if edge and number == 1:
            faults.append(_random_edge(plan, rng))
            sizes.append(float(detectability.sizes(faults[-1:])[0]))
            continue
        for _ in range(_ATTEMPTS):
            taken = {f.id for f in faults} | ({"edge_profile"} if edge else set())
            fault = random_fault(str(rng.choice([n for n in names if n not in taken])), plan, rng)
            if fault.fixed:
                found = float(detectability.sizes([fault])[0])
            else:
                fault, found = scale_to_size(detectability, fault, size)
            if found >= REACHED * size:
                break
        faults.append(fault)
        sizes.append(found)
    near = library.distance_of(faults)
    others = near.lookalikes if kind == "two" else [name for name in near.lookalikes if name != faults[0].id]
    distance = near.single if kind == "two" else None
    return HiddenFaults(kind=kind, faults=tuple(faults), sizes=tuple(sizes), lookalikes=others, distance=distance)


def _draw_unmodelled(plan: Plan, library: LibrarySignatures, names: Sequence[str], rng) -> HiddenFaults:
    """An effect outside the library, scaled until its best three effects leave a drawn distance over."""
    seen = {f"sensor_y{place[-1]}" for place in plan.signals.values()}
    names = tuple(n for n in names if not UNMODELLED[n].place.startswith("sensor_y") or UNMODELLED[n].place in seen)
    wanted = float(np.exp(rng.uniform(*np.log(OUTSIDE))))
    best: tuple[float, Fault, LibraryDistance] | None = None
    for _ in range(_ATTEMPTS):
        fault, near = _scale_to_distance(library, random_fault(str(rng.choice(sorted(names))), plan, rng), wanted)
        if near.largest > _FAR:
            continue
        if best is None or near.triple > best[0]:
            best = near.triple, fault, near
        if near.triple >= REACHED * wanted:
            break
    if best is None:
        raise InputError("outside", names, "", "every one lets the belt run away under this plan; use another")
    _, fault, near = best
    size = float(library.detectability.sizes([fault])[0])
    edge = [_random_edge(plan, rng)] if rng.random() < EDGE_BESIDE["outside"] else []
    sizes = (size, *(float(d) for d in (library.detectability.sizes(edge) if edge else ())))
    return HiddenFaults(
        kind="outside", faults=(fault, *edge), sizes=sizes, lookalikes=near.lookalikes, distance=near.triple
    )


def _scale_to_distance(library: LibrarySignatures, fault: Fault, wanted: float) -> tuple[Fault, LibraryDistance]:
    """The fault scaled to a distance from the library, or as far as its limits and ``_MOST`` go."""
    fault, size = scale_to_size(library.detectability, fault, wanted)
    near = library.distance_of([fault])
    power = 1.0  # with which the distance grows with the size
    for _ in range(4):
        if near.triple * _MOST <= REACHED * wanted * size:
            break  # it is too much like the library
        factor = min((wanted / near.triple) ** (1 / power), largest_scale(fault), _MOST / size)
        if abs(factor - 1) < 0.03:
            break
        before, fault = near.triple, scale_fault(fault, factor)
        near, size = library.distance_of([fault]), float(library.detectability.sizes([fault])[0])
        power = float(np.clip(np.log(max(near.triple, 1e-9) / before) / np.log(factor), 0.7, 4.0))
    return fault, near


def _random_edge(plan: Plan, rng) -> Fault:
    """The edge of a real belt, or a better one."""
    edge = random_fault("edge_profile", plan, rng)
    return scale_fault(edge, float(rng.uniform(*_EDGE)))


# Damaged readings, shape (signals, n, runs): each function changes one signal of one run in place.

_CLIP_SHARE = 0.5  # of the largest reading
_KNOCK = 0.05  # [m]
_LOST_SHARE = (0.4, 0.6)  # of the record


def unit_slip(readings: np.ndarray, signal: int, run: int) -> None:
    """Written in metres in a column of millimetres."""
    readings[signal, :, run] *= 1e-3


def clipped_sensor(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor's range ends half-way."""
    most = _CLIP_SHARE * np.abs(readings[signal, :, run]).max()
    readings[signal, :, run] = np.clip(readings[signal, :, run], -most, most)


def swapped_columns(readings: np.ndarray, signal: int, run: int) -> None:
    """Two plugs exchanged."""
    other = (signal + 1) % len(readings)
    readings[[signal, other], :, run] = readings[[other, signal], :, run]


def wrong_sign(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor looks from the other side."""
    readings[signal, :, run] *= -1


def dropout(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor shows 0 for a while."""
    count = readings.shape[1]
    readings[signal, int(_LOST_SHARE[0] * count) : int(_LOST_SHARE[1] * count), run] = 0.0


def shifted_run(readings: np.ndarray, signal: int, run: int) -> None:
    """The sensor was knocked before this run."""
    readings[signal, :, run] += _KNOCK


CORRUPTIONS = {f.__name__: f for f in (unit_slip, clipped_sensor, swapped_columns, wrong_sign, dropout, shifted_run)}
NEEDS_TWO = ("swapped_columns",)  # signals
