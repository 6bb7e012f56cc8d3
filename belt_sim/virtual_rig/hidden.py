"""What a campaign hides: faults by id, their size in it, and draws at random."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property, lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np
from scipy.linalg import cholesky, solve_triangular

from belt_sim.errors import InputError, finite
from belt_sim.virtual_rig.faults import CATALOGUE, Fault, has_hook
from belt_sim.virtual_rig.line import Line, stack
from belt_sim.virtual_rig.march import TrueErrors, correlation, observe, stated_data, true_line
from belt_sim.virtual_rig.plan import Noise, Plan
from belt_sim.virtual_rig.unmodelled import UNMODELLED

#: the unmodelled faults on which a fitter may have been developed
DEVELOPMENT_FAULTS = (
    *("adhesion_loss", "dead_zone", "mid_stick", "quadratic_contact", "sensor_cubic", "strange_wave", "tension_decay"),
    *("walking_angle", "warming_stand", "wind_steps", "yaw_creep"),
)
#: those that change a span itself, and are drawn by themselves
SPAN_FAULTS = tuple(name for name, cls in UNMODELLED.items() if cls.place.startswith("span_"))
#: all others, which were made for blind tests only
BLIND_FAULTS = tuple(name for name in UNMODELLED if name not in (*DEVELOPMENT_FAULTS, *SPAN_FAULTS))
#: What ``hidden=random`` draws from; the order decides what a seed draws.
RANDOM_LIBRARY = tuple(
    CATALOGUE[name]
    for name in (
        *("yaw_offset_tail", "yaw_offset_head", "cant", "taper", "crown", "wobble", "soft_cover", "slip"),
        *("yaw_compliance", "tension_bias", "encoder_scale", "sensor_gain", "sensor_drift", "edge_profile", "sag_roll"),
        *("yaw_drift", "taper_drift", "build_up", "pulley_deflection", "traction_loss", "unequal_tension"),
        *("machine_tilt", "idler_skew", "side_drag", "off_centre_load", "sensor_delay", "camber", "weld", "edge_guide"),
    )
)


def fault_class(name: str) -> type[Fault]:
    """The class of an id; raises InputError when there is none."""
    known = CATALOGUE | UNMODELLED
    if name not in known:
        own = "the virtual rig hides faults of its own and reads no effect files; " if name.endswith(".py") else ""
        raise InputError("hidden", name, "", f"{own}use one of {', '.join(sorted(known))}")
    return known[name]


def fault_from_spec(spec: str | dict) -> Fault:
    """A fault from an id (its first parameter at typical size) or from {"id": ..., parameter: SI value}."""
    given = {"id": spec} if isinstance(spec, str) else dict(spec)
    cls = fault_class(str(given.pop("id", "")))
    if not given:
        name, size = next(iter(cls.sizes.items()))
        return cls(**{name: size.typical})
    allowed = vars(cls())
    for name, value in given.items():
        if name not in allowed:
            raise InputError(f"hidden {cls.id}", name, "", f"its parameters are {', '.join(allowed)}")
        number = finite(f"hidden {cls.id}.{name}", value, "", "give a number in SI")
        limit = cls.sizes[name].limit if name in cls.sizes else np.inf
        if not (low := 0.0 if cls.positive and name in cls.sizes else -limit) <= number <= limit:
            remedy = f"must lie between {low:g} and {limit:g}"
            raise InputError(f"hidden {cls.id}.{name}", value, cls.sizes[name].unit, remedy)
    made = cls(**given)
    if cls.sizes and not any(getattr(made, name) for name in cls.sizes):
        name, size = next(iter(cls.sizes.items()))
        remedy = f"hides nothing: give a size, as {name}: {size.typical:g}, or hidden=[]"
        raise InputError(f"hidden {cls.id}.{name}", 0, size.unit, remedy)
    return made


# Size d of an effect in a campaign, in units of noise, nuisances projected out; and how unlike the library it is.


#: Trial sizes of an effect: downwards from its limit by this factor, this often.
_FACTOR, _TRIALS = 3.0, 9
_AWAY = 10.0  # [m] a belt that has run away
_REFINED, _CLOSE = 2, 0.01  # rounds in which the size is closed in on, and how close is close
_ROUNDS = 2  # more, in which machine and settings are put where a change looks like them
_FURTHEST = 10.0  # sigma, by which they are
_SEEN = 0.1  # noise units, below which it does not matter that they bend there
# An effect that shows less than a hundredth of the noise at a third of its typical size (``_SMALL``) is rounding, and
# explains nothing; nor do effects that would have to cancel each other to a thousandth of their sizes d.
_UNSEEN, _CANCELLING = 0.01, 1e-3


class Detectability:
    """Measures changes of readings, shape (signals, n, runs), in units of noise as it truly is and nuisances, beside
    faults that are there.

    roots: one matrix a signal that makes its noise white; nuisances: their whitened one-sigma changes, (N, m): first
    the machine's, which move all runs together, then tension, yaw, zeros and gains of every run.
    """

    def __init__(self, plan: Plan, noise: Noise, law: str, faults: tuple[Fault, ...] = ()) -> None:
        self.plan, self.law, travel = plan, law, plan.travel
        length = noise.wander_length if noise.true_length is None else noise.true_length
        scaled: dict = {n: noise.scale * getattr(noise, n) for n in ("white", "wander_sd", "tilt_white")}
        self.noise = replace(noise, **scaled, wander_length=length, scale=1.0, true_length=None)  # stated as it is
        self.base, self.clean, moved = sensitivities(plan, law, faults)
        self.roots, lanes = [], np.eye(self.clean.shape[2])
        found = [change for name, change in moved.items() if name not in ("tension", "yaw")]
        for sigma, name in ((self.noise.tension_rel, "tension"), (self.noise.yaw_u, "yaw")):
            found += [sigma * moved[name] * lane for lane in lanes]
        for k, sheet in enumerate(self.noise.sheets(plan)):
            alike = correlation(travel, sheet.wander_length, noise.smooth)
            covariance = sheet.white**2 * np.eye(len(travel)) + sheet.wander_sd**2 * alike
            self.roots.append(solve_triangular(cholesky(covariance, lower=True), np.eye(len(travel)), lower=True))
            for change in (np.full_like(self.clean, sheet.zero), sheet.gain * self.clean):
                alone = np.zeros_like(self.clean)
                alone[k] = change[k]
                found += [alone * lane for lane in lanes] if alone.any() else []
        self.nuisances = np.stack([self.whiten(c) for c in found], axis=1)
        # with N N' = U diag(l^2) U', the metric (1 + N N')^-1 has the root 1 - U (1 - (1 + l^2)^-1/2) U'
        squares, v = np.linalg.eigh(self.nuisances.T @ self.nuisances)
        felt = squares > 1e-9 * max(squares.max(initial=0.0), 1e-30)
        self._axes = self.nuisances @ v[:, felt] / np.sqrt(squares[felt])
        self._shares = 1 - 1 / np.sqrt(1 + squares[felt])

    def whiten(self, change: np.ndarray) -> np.ndarray:
        """A change as one vector of unit noise."""
        return np.concatenate([(root @ x).ravel() for root, x in zip(self.roots, change, strict=True)])

    def reduce(self, change: np.ndarray) -> np.ndarray:
        """A change as a vector whose length is its d: whitened, and relieved of what the nuisances explain."""
        white = self.whiten(change)
        return white - self._axes @ (self._shares * (self._axes.T @ white))

    @cached_property
    def library(self) -> tuple[np.ndarray, dict[str, np.ndarray]]:
        """Orthogonal axes of all that the library can do, linear about zero, and each effect's columns along them."""
        blocks = {}
        for name, columns in library_signatures(self.plan, self.law).items():
            reduced = np.stack([self.reduce(c) for c in columns], axis=1)
            blocks[name] = reduced / np.maximum(np.linalg.norm(reduced, axis=0), _UNSEEN)
        axes = np.linalg.qr(np.concatenate(list(blocks.values()), axis=1))[0]
        return axes, {name: axes.T @ block for name, block in blocks.items()}

    def sizes(self, faults: Sequence[Fault]) -> np.ndarray:
        """d of each of several faults, all observed in one batch, shape (faults,).

        A tension that errs does just what other settings of the runs do: where these bend, that is no size either.
        """
        seen = np.stack([self.whiten(c) for c in changes(self.plan, self.base, self.clean, faults)])
        # what machine and settings do beyond their derivatives where they most likely are after a change, if it shows
        names, runs = [n for n, q in stated_data(self.plan).items() if q.u > 0], len(self.plan.runs)
        shapes = self.nuisances[:, : len(names) + 2 * runs]
        normal = np.eye(self.nuisances.shape[1]) + self.nuisances.T @ self.nuisances
        bent, rows = np.zeros_like(seen), list(range(len(seen)))
        for _ in range(1 + _ROUNDS):
            likeliest = np.linalg.solve(normal, self.nuisances.T @ (seen[rows] - bent[rows]).T).T[:, : shapes.shape[1]]
            likeliest = likeliest.clip(-_FURTHEST, _FURTHEST)
            lines = []
            for row in likeliest:  # machine data, tension and yaw of every run so many sigma off
                tension, yaw = np.split(row[len(names) :], 2)
                off = {n: float(sigmas) * stated_data(self.plan)[n].u for n, sigmas in zip(names, row, strict=False)}
                errors = TrueErrors(
                    machine=off, tension_rel=self.noise.tension_rel * tension, yaw=self.noise.yaw_u * yaw
                )
                lines.append(replace(true_line(self.plan, self.law, errors), run=np.arange(runs)))
            there = np.split(observe(self.plan, stack(lines), []), len(lines), axis=2)
            found = np.stack([self.whiten(t - self.clean) for t in there]) - likeliest @ shapes.T
            bent[rows] = np.where(np.linalg.norm(found, axis=1, keepdims=True) > _SEEN, found, 0.0)
            rows = np.flatnonzero(bent.any(axis=1)).tolist()
            if not rows:
                break
        return np.linalg.norm([x - self._axes @ (self._shares * (self._axes.T @ x)) for x in seen - bent], axis=1)


def changes(plan: Plan, base: Line, clean: np.ndarray, faults: Sequence[Fault]) -> list[np.ndarray]:
    """Change of the readings, shape (signals, n, runs), by each fault alone, all in one march."""
    runs, lanes = len(plan.runs), []
    for cls in sorted({type(f) for f in faults}, key=lambda c: c.id):  # as one fault, null in the lanes of others
        null = vars(cls())
        rows = [vars(f) if type(f) is cls else null for f in faults]
        alike = next(f for f in faults if type(f) is cls)
        given = {
            n: np.repeat([row[n] for row in rows], runs) if isinstance(value, float) else getattr(alike, n)
            for n, value in null.items()
        }
        lanes.append(cls(**given))
    with np.errstate(all="ignore"):  # a trial size may let the belt run away
        seen = observe(plan, stack([base] * len(faults)), lanes)
    seen = np.nan_to_num(seen, nan=_AWAY, posinf=_AWAY, neginf=-_AWAY).clip(-_AWAY, _AWAY)
    return [seen[:, :, k * runs : (k + 1) * runs] - clean for k in range(len(faults))]


@lru_cache(maxsize=4)
def sensitivities(
    plan: Plan, base: str, faults: tuple[Fault, ...] = ()
) -> tuple[Line, np.ndarray, dict[str, np.ndarray]]:
    """The line, its readings with faults, and their change by one sigma of each machine datum and by a unit of each
    setting."""
    runs, unit = len(plan.runs), {"tension": 1e-3, "yaw": 1e-6}
    steps = {name: TrueErrors(machine={name: q.u}) for name, q in stated_data(plan).items() if q.u > 0}
    steps |= {"tension": TrueErrors(tension_rel=unit["tension"]), "yaw": TrueErrors(yaw=unit["yaw"])}
    lines = [replace(true_line(plan, base, e), run=np.arange(runs)) for e in (TrueErrors(), *steps.values())]
    seen = observe(plan, stack(lines), faults)
    clean, *moved = (seen[:, :, k * runs : (k + 1) * runs] for k in range(len(lines)))
    return lines[0], clean, {n: (m - clean) / unit.get(n, 1.0) for n, m in zip(steps, moved, strict=True)}


def scale_to_size(detectability: Detectability, fault: Fault, wanted: float) -> tuple[Fault, float]:
    """The fault, its sizes scaled together until its d is ``wanted`` or a limit is met; and the d it has."""
    scales = largest_scale(fault) / _FACTOR ** np.arange(_TRIALS)[::-1]
    found = np.maximum.accumulate(detectability.sizes([scale_fault(fault, s) for s in scales]))
    k = int(np.searchsorted(found, wanted))
    if k == len(scales):
        return scale_fault(fault, scales[-1]), float(found[-1])
    low, high = (scales[k - 1], found[k - 1]) if k else (0.0, 0.0), (scales[k], found[k])
    for _ in range(_REFINED):
        share = (wanted - low[1]) / max(high[1] - low[1], 1e-12)
        trials = low[0] + (high[0] - low[0]) * np.clip([0.8 * share, share, 0.2 + 0.8 * share], 0.0, 1.0)
        seen = np.maximum.accumulate(detectability.sizes([scale_fault(fault, s) for s in trials]))
        close = int(np.argmin(np.abs(seen - wanted)))
        if abs(seen[close] - wanted) < _CLOSE * wanted:
            return scale_fault(fault, float(trials[close])), float(seen[close])
        points = sorted([low, *zip(trials, seen, strict=True), high])
        above = next(i for i, p in enumerate(points) if p[1] >= wanted)
        low, high = points[max(above - 1, 0)], points[above]
    share = (wanted - low[1]) / max(high[1] - low[1], 1e-12)
    return scale_fault(fault, float(low[0] + np.clip(share, 0.0, 1.0) * (high[0] - low[0]))), wanted


def largest_scale(fault: Fault) -> float:
    """By how much a fault's sizes may be multiplied before the first meets its limit."""
    return min(size.limit / abs(v) for name, size in fault.sizes.items() if (v := getattr(fault, name)) != 0.0)


def scale_fault(fault: Fault, factor: float) -> Fault:
    """The fault with all its sizes multiplied."""
    return replace(fault, **{name: factor * getattr(fault, name) for name in fault.sizes})


LOOKALIKE_REMAINDER = 3.0  # noise units that a lookalike may leave over, but no more than
_ALIKE_SHARE = 0.5  # of the effect's own size
_BEAM = 6  # best sets of one size that are tried with one more effect
_SMALL = 0.3  # of the typical size


class LibraryDistance(NamedTuple):
    """Single effects that come close to a change, and what the best single one and the best three effects of the
    library leave over of it [noise units]; largest: the largest change of any reading [m or rad]."""

    lookalikes: list[str]
    single: float
    triple: float
    largest: float


def library_distance(rule: Detectability, faults: Sequence[Fault]) -> LibraryDistance:
    """The distance of the faults' joint change to the library."""
    change = np.sum(changes(rule.plan, rule.base, rule.clean, faults), axis=0)
    target, (axes, blocks) = rule.reduce(change), rule.library
    inside = axes.T @ target
    beyond = max(float(target @ target - inside @ inside), 0.0)
    kept: list[tuple[float, tuple[str, ...]]] = [(float("inf"), ())]
    best = []
    singles: dict[str, float] = {}
    for _ in range(3):
        sets = {tuple(sorted({*names, n})) for _, names in kept[:_BEAM] for n in blocks if n not in names}
        kept = []
        for names in sets:
            basis = np.concatenate([blocks[n] for n in names], axis=1)
            rest = inside - basis @ np.linalg.lstsq(basis, inside, rcond=_CANCELLING)[0]
            kept.append((float(np.sqrt(np.sum(rest**2) + beyond)), names))
        kept.sort()
        best.append(kept[0][0])
        singles = singles or {names[0]: left for left, names in kept}
    allowed = min(LOOKALIKE_REMAINDER, _ALIKE_SHARE * float(np.linalg.norm(target)))
    alike = sorted(n for n, left in singles.items() if left < allowed)
    return LibraryDistance(lookalikes=alike, single=best[0], triple=best[2], largest=float(np.abs(change).max()))


@lru_cache(maxsize=4)
def library_signatures(plan: Plan, base: str) -> dict[str, list[np.ndarray]]:
    """Effect of the library -> changes of the readings, (signals, n, runs), by each of its parameters, small, in each
    shape."""
    line, clean, _ = sensitivities(plan, base)
    faults: list[Fault] = []
    for cls in (cls for cls in RANDOM_LIBRARY if not cls.fixed and base not in (*cls.part_of, *cls.idle_on)):
        grids = {f.name: f.metadata["grid"](plan) for f in fields(cls) if "grid" in f.metadata}
        grids = {name: values for name, values in grids.items() if len(values)}
        shapes = [dict(zip(grids, values, strict=True)) for values in product(*grids.values())]
        shown = [n for n, size in cls.sizes.items() if not size.place or size.place in plan.signals.values()]
        faults += [cls(**{n: _SMALL * cls.sizes[n].typical}, **shape) for n in shown for shape in shapes]
    columns: dict[str, list[np.ndarray]] = {}
    for hook in ("edge", "loads", "turn", ""):  # each lane pays for the hooks of all faults that march with it
        together = [f for f in faults if next((h for h in ("edge", "loads", "turn") if has_hook(f, h)), "") == hook]
        if hook == "edge":  # which changes nothing of the march
            found, s = [np.zeros_like(clean) for _ in together], np.broadcast_to(plan.travel[:, None], clean.shape[1:])
            for k, place in enumerate(plan.signals.values()):
                for change, f in zip(found, together if place.startswith("point_") else [], strict=False):
                    change[k] = f.edge(place, s, line) - f.edge(place, line.yaw_at + 0 * s[:1], line)
        else:
            found = changes(plan, line, clean, together)
        for fault, change in zip(together, found, strict=True):
            columns.setdefault(fault.id, []).append(change)
    return {name: columns[name] for name in sorted(columns) if any(np.any(c) for c in columns[name])}


# As specified, or drawn at random.


#: What is hidden -> how often.
MIX = {"nothing": 0.30, "library": 0.35, "two": 0.10, "outside": 0.15, "below_noise": 0.05, "dirty": 0.05}
LIBRARY_SIZES = (3.0, 6.0, 12.0, 24.0)  # d of one library effect
OUTSIDE = (6.0, 30.0)  # what the best three library effects leave over of an unmodelled fault
#: In this share of the sets of two, and of unmodelled faults, one more thing is a real belt's edge.
EDGE_BESIDE = {"two": 0.3, "outside": 0.1}
_TWO_SIZES = LIBRARY_SIZES[1:]
_BELOW = (0.3, 1.0)
_EDGE = (0.2, 1.0)  # share of the measured profile
REACHED = 0.8  # share of the wanted size that an effect must reach within its limits
_MOST = 400.0  # noise units: an unmodelled fault that needs more to stand out from the library is drawn again
_FAR = 0.05  # [m]: what moves a belt further is no fault that is measured, but one that is seen
_ATTEMPTS = 8


@dataclass(frozen=True, kw_only=True)
class HiddenFaults:
    """Faults with their sizes d (None: not measured), and what stands in ``Truth`` beside them."""

    kind: str
    faults: tuple[Fault, ...] = ()
    sizes: tuple[float | None, ...] = ()
    lookalikes: list[str] = field(default_factory=list)
    distance: float | None = None
    dirty: str | None = None


def specified_hidden(hidden: Sequence[str | dict], rule: Callable[[], Detectability] | None) -> HiddenFaults:
    """Faults from ids and dictionaries; {"id": ..., "d": 12} scales to a size by ``rule()``; None refuses that."""
    if isinstance(hidden, str) or not isinstance(hidden, Sequence):
        more = "; random needs engine=line" if hidden == "random" else ""
        raise InputError("hidden", hidden, "", f"give a list of ids, or of dictionaries with an id{more}")
    faults: list[Fault] = []
    sizes = []
    for spec in hidden:
        if not isinstance(spec, str | dict):
            raise InputError("hidden", spec, "", "give ids, or dictionaries with an id")
        wanted = None
        if isinstance(spec, dict) and "d" in spec:
            if rule is None:
                raise InputError("hidden", "d", "", "give the effect's own parameters with engine=mujoco")
            spec = dict(spec)
            cls = fault_class(str(spec.get("id", "")))
            if both := [name for name in spec if name in cls.sizes and name != "d"]:
                raise InputError(f"hidden {cls.id}", f"{both[0]} and d", "", f"give {both[0]} or d; d sets it")
            wanted = finite("hidden d", spec.pop("d"), "", "give a positive number of noise units", lambda d: d > 0)
        fault = fault_from_spec(spec)
        if any(type(fault) is type(known) for known in faults):
            raise InputError("hidden", fault.id, "", "name each fault once")
        fault, size = (fault, None) if wanted is None or rule is None else scale_to_size(rule(), fault, wanted)
        faults.append(fault)
        sizes.append(size)
    kind = "stated" if faults else "nothing"
    return HiddenFaults(kind=kind, faults=tuple(faults), sizes=tuple(sizes))


def random_hidden(
    plan: Plan,
    rule: Callable[[], Detectability],
    base: str,
    rng: np.random.Generator,
    *,
    kind: str | None = None,
    unmodelled: Sequence[str] = BLIND_FAULTS + DEVELOPMENT_FAULTS,
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
        return _draw_unmodelled(plan, rule(), acting, rng)
    # effects of the library, each at its wanted size; what cannot get so large is drawn again
    names = [cls.id for cls in RANDOM_LIBRARY if base not in (*cls.part_of, *cls.idle_on)]
    names = [name for name in names if not library or name in library]
    if kind == "below_noise":
        wanted = [float(rng.uniform(*_BELOW))]
    else:
        wanted = [float(rng.choice(s)) for s in ([_TWO_SIZES, _TWO_SIZES] if kind == "two" else [LIBRARY_SIZES])]
    shown = rule()
    faults: list[Fault] = []
    sizes: list[float] = []
    edge = kind == "two" and rng.random() < EDGE_BESIDE[kind]
    for number, size in enumerate(wanted):
        if edge and number == 1:
            faults.append(scale_fault(random_fault("edge_profile", plan, rng), float(rng.uniform(*_EDGE))))
            sizes.append(float(shown.sizes(faults[-1:])[0]))
            continue
        for _ in range(_ATTEMPTS):
            taken = {f.id for f in faults} | ({"edge_profile"} if edge else set())
            fault = random_fault(str(rng.choice([n for n in names if n not in taken])), plan, rng)
            if fault.fixed:
                found = float(shown.sizes([fault])[0])
            else:
                fault, found = scale_to_size(shown, fault, size)
            if found >= REACHED * size:
                break
        faults.append(fault)
        sizes.append(found)
    near = library_distance(shown, faults)
    others = near.lookalikes if kind == "two" else [name for name in near.lookalikes if name != faults[0].id]
    distance = near.single if kind == "two" else None
    return HiddenFaults(kind=kind, faults=tuple(faults), sizes=tuple(sizes), lookalikes=others, distance=distance)


def random_fault(name: str, plan: Plan, rng: np.random.Generator) -> Fault:
    """A fault of typical size with its sign, place and phase drawn."""
    cls = fault_class(name)
    sign = 1.0 if cls.positive or cls.fixed else float(rng.choice((-1.0, 1.0)))
    # of the parameters that the plan's sensors can show
    sizes = {n: s for n, s in cls.sizes.items() if not s.place or s.place in plan.signals.values()}
    if not sizes:
        raise InputError("hidden", name, "", "needs a lateral sensor, which the plan has not")
    if cls.mixed:
        chosen = {n: float(s.typical * rng.standard_normal()) for n, s in sizes.items()}
    else:
        picked = str(rng.choice(list(sizes)))
        chosen = {picked: sign * sizes[picked].typical}
    for f in fields(cls):
        if "draw" in f.metadata:
            drawn = f.metadata["draw"](plan, rng)
            chosen[f.name] = int(drawn) if isinstance(drawn, int | np.integer) else float(drawn)
    return cls(**chosen)


def _draw_unmodelled(plan: Plan, rule: Detectability, names: Sequence[str], rng) -> HiddenFaults:
    """An effect outside the library, scaled until its best three effects leave a drawn distance over."""
    seen = {f"sensor_y{place[-1]}" for place in plan.signals.values()}
    names = tuple(n for n in names if not UNMODELLED[n].place.startswith("sensor_y") or UNMODELLED[n].place in seen)
    wanted = float(np.exp(rng.uniform(*np.log(OUTSIDE))))
    best: tuple[float, Fault, LibraryDistance] | None = None
    for _ in range(_ATTEMPTS):
        fault = random_fault(str(rng.choice(sorted(names))), plan, rng)
        fault, size = scale_to_size(rule, fault, wanted)
        near, power = library_distance(rule, [fault]), 1.0  # with which the distance grows with the size
        for _ in range(4):
            if near.triple * _MOST <= REACHED * wanted * size:
                break  # it is too much like the library
            factor = min((wanted / near.triple) ** (1 / power), largest_scale(fault), _MOST / size)
            if abs(factor - 1) < 0.03:
                break
            before, fault = near.triple, scale_fault(fault, factor)
            near, size = library_distance(rule, [fault]), float(rule.sizes([fault])[0])
            power = float(np.clip(np.log(max(near.triple, 1e-9) / before) / np.log(factor), 0.7, 4.0))
        if near.largest > _FAR:
            continue
        if best is None or near.triple > best[0]:
            best = near.triple, fault, near
        if near.triple >= REACHED * wanted:
            break
    if best is None:
        raise InputError("outside", names, "", "every one lets the belt run away under this plan; use another")
    _, fault, near = best
    faults, sizes = [fault], [float(rule.sizes([fault])[0])]
    if rng.random() < EDGE_BESIDE["outside"]:
        faults.append(scale_fault(random_fault("edge_profile", plan, rng), float(rng.uniform(*_EDGE))))
        sizes.append(float(rule.sizes(faults[1:])[0]))
    alike, left = near.lookalikes, near.triple
    return HiddenFaults(kind="outside", faults=tuple(faults), sizes=tuple(sizes), lookalikes=alike, distance=left)


# Damaged readings.

#: Kind -> what the column of a signal in one run becomes; x: its readings, other: those of the next signal.
_DAMAGED: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "unit_slip": lambda x, other: 1e-3 * x,  # written in metres in a column of millimetres
    "clipped_sensor": lambda x, other: x.clip(-(most := 0.5 * np.abs(x).max()), most),  # its range ends half-way
    "swapped_columns": lambda x, other: other.copy(),  # two plugs exchanged
    "wrong_sign": lambda x, other: -x,  # the sensor looks from the other side
    "dropout": lambda x, other: np.concatenate(  # it shows 0 for a while
        [x[: (a := int(0.4 * len(x)))], np.zeros((b := int(0.6 * len(x))) - a), x[b:]]
    ),
    "shifted_run": lambda x, other: x + 0.05,  # [m]: it was knocked before this run
}
CORRUPTIONS, NEEDS_TWO = tuple(_DAMAGED), ("swapped_columns",)  # signals


def damage(readings: np.ndarray, kind: str, signal: int, run: int) -> None:
    """Damage one signal of one run, or two signals that are exchanged, in place; readings: (signals, n, runs)."""
    rows, beside = readings[:, :, run], (signal + 1) % len(readings)
    before = rows[signal].copy()
    rows[signal] = _DAMAGED[kind](before, rows[beside])
    if kind in NEEDS_TWO:
        rows[beside] = before
