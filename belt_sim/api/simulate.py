"""Cases simulated: what people name (models, effects, campaigns) as objects; one case or a batch, and where its model
stops being valid; the scene of a 3D case; curves that JAX can trace; the plant that a controller sees and its files."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from belt_sim.campaign.types import Campaign, case_of, first_place_inside_span
from belt_sim.case import Case
from belt_sim.curves import Curves, Observer
from belt_sim.effects.base import Effect, library
from belt_sim.effects.generic_law import law_effect, law_of_entry
from belt_sim.effects.load import check_numbers, load_classes, load_effects
from belt_sim.errors import BeltError, CannotRepresent, InputError, Limit, SimulationError, finite, warning
from belt_sim.io import provenance, write_json
from belt_sim.line.hooks import BEFORE_ENGINE, asked_of_engine, overrides
from belt_sim.line.march import KEEP, MARCH_STEP, march_case, march_traced, plan_steps
from belt_sim.line.spans import RitzingerFormula
from belt_sim.model import ANALYTIC, BY_TENSION, IN_SPACE, MODEL_NAMES, MODELS, AnalyticModel, ModelName
from belt_sim.results.simulation import Simulation
from belt_sim.settings import case_from, case_or_settings, check_range
from belt_sim.space.model import BATCH_ENGINES, SpaceModel, batch_engine
from belt_sim.space.options import AS_THE_CASE, CONTACTS, WATCHED, fit_options, refuse_unobeyed
from belt_sim.units import N_PER_MM2
from belt_sim.validity import exceeded_limits, geometric, lifts_off, run_limits

if TYPE_CHECKING:
    from mujoco import MjSpec

    from belt_sim.linear.plant import LinearBelt, PlantSchedule
    from belt_sim.space.run import Computed

Model = AnalyticModel | SpaceModel | RitzingerFormula
#: a model by name, by name and settings, or as an object
ModelSpec = ModelName | str | Mapping[str, Any] | Model


def models() -> dict[str, str]:
    """The title of every model by its name."""
    return {name: model_named(name).title for name in MODEL_NAMES}


def model_named(name: str, settings: Mapping[str, Any] | None = None) -> Model:
    """The model of a name; settings: its own numbers (step, keep; dx, dt, friction ...), None keeps the default.

    Raises InputError for an unknown model or setting.
    """
    given = {k: v for k, v in (settings or {}).items() if v is not None}
    if name in IN_SPACE:
        return SpaceModel.from_settings(IN_SPACE[name], given)
    if name not in ANALYTIC:
        raise InputError("model", name, "", f"use one of {', '.join(MODEL_NAMES)}")
    known = () if name == "ritzinger" else ("step", "keep")
    for key, value in given.items():
        if key not in known:
            raise InputError(f"model.{key}", value, "", f"use one of {', '.join(known)}" if known else "leave it out")
        check_range({f"model.{key}": value}, f"model.{key}")
    return RitzingerFormula() if name == "ritzinger" else replace(MODELS[name], **given)


def campaign_of(spec: Campaign | str | Path) -> Campaign:
    """A campaign by the name of one that ships, by its folder, or as it is; raises CampaignError, InputError."""
    if isinstance(spec, Campaign):
        return spec
    if not isinstance(spec, str | Path):
        remedy = "give a campaign, its folder, or the name of one that ships"
        raise InputError("campaign", type(spec).__name__, "", remedy)
    from belt_sim.campaign.folder import read_campaign  # files of a campaign: a run of a model has none

    return read_campaign(spec)


def states_model(spec: Any) -> bool:
    """Whether ``spec`` (a name, a mapping, a model) states one; None and "by_tension" leave the choice to the belt."""
    return (spec.get("name") if isinstance(spec, Mapping) else spec) not in (None, BY_TENSION)


def model_for_campaign(campaign: Campaign) -> str:
    """The model of a campaign for which none is stated, and after a comma why it is this one."""
    if campaign.source.kind == "synthetic":
        return "strip, as these data are simulated without lift-off"
    slackest = sorted(campaign.runs, key=lambda run: run.tension)
    slack = next((run for run in slackest if lifts_off(case_of(campaign, run))), None)
    if slack is None:
        return "strip, as in no run the belt is so slack that it lifts off"
    if first_place_inside_span(campaign.signals):
        return "strip, as a sensor stands inside a span, where strip_lift_off is silent"
    slackest_run = f"run {slack.name} ({slack.tension / N_PER_MM2:.4g} N/mm2)"
    return f"strip_lift_off, as {slackest_run} is so slack that the belt lifts off"


def campaign_model(spec: Any, campaign: Campaign) -> Model:
    """The model of ``spec``, or where it states none the one for all runs of a campaign; raises InputError.

    A synthetic campaign is judged by strip: belts of the virtual rig leave their pulleys like a thread.
    """
    if not states_model(spec):
        own = model_for_campaign(campaign).partition(",")[0]
        spec = {**(spec if isinstance(spec, Mapping) else {}), "name": own}
    chosen = model_of(spec)
    for name, standard in (("step", MARCH_STEP), ("keep", KEEP)) if isinstance(chosen, AnalyticModel) else ():
        if (given := getattr(chosen, name)) != standard:
            remedy = "a campaign's march is as fine as its readings ask for; leave it out"
            raise InputError(f"model.{name}", given, "m", remedy)
    return chosen


def model_of(spec: Any, cases: Sequence[Case] = (), effects: Sequence[str] = (), engine: str | None = None) -> Model:
    """A model by name, by mapping {name: strip, step: 0.05}, or as it is; raises InputError for anything else.

    Where ``spec`` states none and there are ``cases``, the one for all of them with ``effects`` (ids): strip_lift_off
    where strip would be beyond its limit bending_layer in one of them, as of a slack belt; strip where it is in none,
    or where the effect lift_off is stated. engine: of a 3D model; an analytic one has None or "native".
    """
    if cases and not states_model(spec):
        slack = "lift_off" not in effects and any(lifts_off(case) for case in cases)
        spec = {**(spec if isinstance(spec, Mapping) else {}), "name": "strip_lift_off" if slack else "strip"}
    if isinstance(spec, Mapping) and "name" in spec:
        chosen = model_named(str(spec["name"]), {k: v for k, v in spec.items() if k != "name"})
    elif isinstance(spec, str | Model):
        chosen = model_named(spec) if isinstance(spec, str) else spec
    else:
        raise InputError("model", spec, "", "give a name, as model=strip, or a mapping {name: strip, step: 0.05}")
    if engine is None or (engine == "native" and not isinstance(chosen, SpaceModel)):
        return chosen
    if not isinstance(chosen, SpaceModel):
        raise InputError("engine", engine, "", f"leave it out: model={chosen.name} is not a belt in three dimensions")
    return replace(chosen, engine=engine)


def fitted_model(spec: Any, curves: bool = True) -> AnalyticModel:
    """A model that can be fitted to curves, or without ``curves`` one that gives steady rates in closed form, of which
    it may be ``RitzingerFormula``; raises CannotRepresent for the others."""
    model: Any = model_of(spec)
    if not isinstance(model, AnalyticModel | RitzingerFormula):
        raise CannotRepresent(f"model = {model.name}: an analytic model is needed here, e.g. model=strip")
    if curves and isinstance(model, RitzingerFormula):
        raise CannotRepresent(f"model = {model.name}: it gives a steady rate and no curves; use e.g. model=beam_th2")
    return model  # type: ignore[return-value]  # a formula only where no curves are asked for


def refuse_undeclared(cls: type[Effect]) -> None:
    """Raise InputError for a class without the decorator, which JAX cannot pass on."""
    if "declared" not in vars(cls):
        raise InputError("effects", cls.__name__, "", f"write @effect above the class {cls.__name__}")


def effects_of(asked: Any) -> tuple[Effect, ...]:
    """Effects with numbers.

    asked: None, an effects.yaml, or a list of ids, .py files, mappings {id: taper, kappa_t: 2e-5}, Effect objects and
    the effects that a diagnosis found.
    """
    found_by = "by_explanation"  # what a diagnosis has found has it; a curve does not wait for the types of a diagnosis
    made = [asked] if isinstance(asked, Effect) or hasattr(asked, found_by) else asked
    if not isinstance(made, Sequence) or isinstance(made, str):
        return load_effects(made)
    found: list[Effect] = []
    for e in made:
        if isinstance(e, type) and issubclass(e, Effect):
            refuse_undeclared(e)
            example = f"{e.__name__}({next(iter(e.parameters))}=...)"
            raise InputError("effects", e.__name__, "", f"give it numbers: {example}")
        if isinstance(e, Effect):
            refuse_undeclared(type(e))
            found.append(replace(e, **check_numbers(type(e), {name: getattr(e, name) for name in e.parameters})))
        elif hasattr(e, found_by) and e.law:
            found.append(law_effect(law_of_entry(e.law))())
        else:
            entry = {"id": e.source_file or e.id, "parameters": dict(e.numbers)} if hasattr(e, found_by) else e
            found += load_effects([entry])
    for twice in {e.id for e in found if sum(o.id == e.id for o in found) > 1}:
        raise InputError("effects", twice, "", "name each effect once")
    return tuple(found)


def candidates_of(asked: Any, model: AnalyticModel, leave_out: Sequence[str] | None = None) -> list[type[Effect]]:
    """Effect classes to try, all of which the model can honour.

    asked: a list of ids, .py files and Effect classes, all of which must be possible; or None for the library without
    ``leave_out`` (None: without what is tried only when it is named). Raises InputError, CannotRepresent.
    """
    for name in leave_out or ():
        if name not in library():
            raise InputError("leave_out", name, "", f"use ids of the library: {', '.join(library())}")
    if asked is None:
        from belt_sim.diagnosis.forward import ONLY_WHEN_NAMED  # a curve needs neither it nor SciPy

        excluded = ONLY_WHEN_NAMED if leave_out is None else leave_out
        return [c for name, c in library().items() if name not in excluded and model.refusal(c) is None]
    entries = asked if isinstance(asked, Sequence) and not isinstance(asked, str) else [asked]
    for entry in (e for e in entries if isinstance(e, type) and issubclass(e, Effect)):
        refuse_undeclared(entry)
    if not (classes := load_classes(entries)):
        raise InputError("effects", "[]", "", "name at least one candidate, or null for the library")
    refuse_effects(model, list(classes.values()))
    return list(classes.values())


def refuse_effects(model: Model, effects: Sequence[Effect | type[Effect]], remedy: str = "") -> None:
    """Raise CannotRepresent for the first effect that the model cannot represent."""
    for e in effects:
        reason = model.refusal(e)
        if reason:
            raise CannotRepresent(f"effects = {e.id}: {reason}{remedy}")


#: load of the limit slack_edge from which a line of nodes, b / sqrt(12) from the middle, is slack
SLACK_LINE = math.sqrt(3.0)
SLACK_SCENE = "the yaw slackens an edge of the belt, and y here is up to 6 % of its largest off a held belt's"
#: limits that a belt in three dimensions does not have: it moves, turns far and hangs as it is
_NOT_IN_SPACE = ("flat_belt", "second_order", "deep_sag", "fast_belt")


#: Load of a limit in the run over its load by the yaw alone, above which the run's is told: effects took it further.
FURTHER_IN_RUN = 1.05


def validity_limits(case: Case, model: Any, effects: Sequence[str] = ()) -> tuple[Limit, ...]:
    """The limits that ``model`` with ``effects`` (ids) is used beyond in one case, the worst first.

    A limp rope and formulas without curves claim no more than their limiting case: what machine and belt are beyond
    whatever the model is said of all.
    """
    found: tuple[Limit, ...] = ()
    if isinstance(model, AnalyticModel) and model.moments:
        found = exceeded_limits(case, {*model.contains, *effects})
    elif isinstance(model, SpaceModel) and "sag_roll" in model.contains:
        slips = ("slip",) if math.isfinite(model.options.friction) else ()
        lifts = "the belt's own stiffness lifts it off the pulleys, which a belt in 3D has only with effects=[lift_off]"
        beyond = exceeded_limits(case, {*model.contains, *effects, *_NOT_IN_SPACE, *slips})
        words = {"bending_layer": lifts}
        if model.contact == CONTACTS[1]:
            words |= {x.id: SLACK_SCENE for x in beyond if x.id == "slack_edge" and x.load > SLACK_LINE}
        found = tuple(replace(limit, words=words.get(limit.id, limit.words)) for limit in beyond)
    there = {x.id for x in found}
    there |= {*_NOT_IN_SPACE, "short_span", "edge_stretch"} if isinstance(model, SpaceModel) else set()
    there |= {"edge_stretch"} if "slack_edge" in there else set()
    return (*found, *(x for x in geometric(case) if x.id not in there))


def with_run(
    beyond: tuple[Limit, ...], case: Case, model: Any, curves: Curves, effects: Sequence[Effect] = ()
) -> tuple[Limit, ...]:
    """Return the limits that a case is beyond, and those that its run left with all its effects.

    One that is left by both is told once: with the larger load, or as the case's own where they differ by under 5 %.
    How far a belt slips a march alone says: a yaw that comes as a ramp, or a smaller pulley, slips less. A run in 3D
    knows it of run-ups only.
    """
    slides = ("slip",) if isinstance(model, SpaceModel) and math.isfinite(model.options.friction) else ()
    contains = {*(e.id for e in effects), *slides}
    linear = isinstance(model, AnalyticModel)
    left = run_limits(case, curves, linear, effects, contains)
    beyond = tuple(x for x in beyond if x.id != "slip" or not linear or curves.moment is None)
    own = {x.id: x.load for x in beyond}
    further = {x.id: x for x in left if x.load > FURTHER_IN_RUN * own.get(x.id, 0.0)}
    return (*(further.pop(x.id, x) for x in beyond), *further.values())


def limits_of_run(case: Case, model: Any, effects: Sequence[Effect], travel: float = 60.0) -> tuple[Limit, ...]:
    """Return the limits that a case is beyond, and those that its run over ``travel`` [m] leaves, if that is finite."""
    beyond = validity_limits(case, model, [e.id for e in effects])
    with suppress(SimulationError):
        return with_run(beyond, case, model, march_case(case, model, effects, travel=travel), effects)
    return beyond


def simulate(
    case: Case | None = None,
    *,
    tension: float | None = None,
    yaw: Any = None,
    yaw_head: Any = None,
    speed: float | None = None,
    direction: float | None = None,
    rig: Any = None,
    belt: Any = None,
    travel: float = 60.0,
    model: ModelSpec | None = None,
    effects: Any = None,
    engine: str | None = None,
    observers: Sequence[Observer] = (),
    scene_path: Path | None = None,
    computed: Any = None,
) -> Simulation:
    """Run ``case`` (in SI), or the case that the settings describe, for ``travel`` [m].

    Settings as on the command line: rig and belt (a name, a mapping or an object), tension [N/mm2], yaw and yaw_head
    [degrees, {dx, d} in metres, or a list of {at, over, yaw}], speed [m/s], direction. ``bs.sweep`` takes many.

    model: a name, {name: ..., further settings} or a Model; None: strip, or of a slack belt strip_lift_off; engine: of
    a 3D model, "native" (None), "mjx" or "quasi_static"; effects: ids, mappings, .py files or objects. scene_path:
    where a 3D model writes its scene (MJCF); computed: what a batch has found for it as driven, so that no engine runs.
    A 3D model's setting ``scene`` is an MjSpec that ``bs.scene`` made, edited, or the path of an XML: that is run
    instead, by MuJoCo's contacts.
    """
    given = {"tension": tension, "yaw": yaw, "yaw_head": yaw_head, "speed": speed, "direction": direction}
    given |= {"rig": rig, "belt": belt}
    case = case_or_settings(case, given | ({"travel": travel} if case is None else {}))
    acting = effects_of(effects)
    ids, travel = [e.id for e in acting], float(travel)
    chosen = model_of(model, [case], ids, engine)
    beyond = validity_limits(case, chosen, ids)
    steady = chosen.steady_rate(case) if not isinstance(chosen, SpaceModel) and not acting else None
    found = Simulation(
        case=case, model=chosen.name, effects=acting, travel=travel, curves=None, steady_rate=steady, beyond=beyond
    )
    if isinstance(chosen, RitzingerFormula):
        refuse_effects(chosen, acting, "; leave it out or use model=beam_th2 or strip")
        return found
    space = isinstance(chosen, SpaceModel)
    more: dict[str, Any] = {"scene_path": scene_path, "computed": computed} if space else {}
    curves = chosen.run(case, acting, travel=travel, observers=observers, **more)
    found = replace(found, curves=curves, beyond=with_run(beyond, case, chosen, curves, acting))
    if not isinstance(chosen, SpaceModel):
        return replace(found, keep=getattr(chosen, "keep", 0.0))
    used = chosen.options_for(asked_of_engine(case, acting, travel)[0])
    details = {"options": asdict(used), "engine": chosen.engine, "contact": chosen.contact}
    details |= {"scene": scene_path.name} if scene_path and scene_path.is_file() else {}
    return replace(found, details=details, steady_rate=float(found.rates.mean()) if found.is_settled else None)


def run_in_batches(
    configs: Sequence[Mapping[str, Any]], batch: int | None
) -> Iterator[tuple[Sequence[int], Sequence["Computed | None"]]]:
    """Numbers of the configurations of a batch, and what it found for each; batch: most cases of one, None: that fit.

    Frames of cases that are to be watched are kept for them. What cannot be marched comes first, with None: its own
    run says why.
    """
    without: list[int] = []
    alike: dict[Any, list[tuple[int, Any]]] = {}
    for number, config in enumerate(configs):
        made: Any = None
        with suppress(BeltError):  # the case as its own run would march it
            case = case_from(config)
            model = model_of(config["model"], [case], engine=config["engine"])
            space = model if isinstance(model, SpaceModel) and model.contact == CONTACTS[0] else None
            if space and space.engine in BATCH_ENGINES and config["watch"] != "viewer":
                effects = effects_of(config["effects"])
                space.admit(effects)
                driven, far = asked_of_engine(case, effects, float(config["travel"]))
                asked: dict[str, Any] = {
                    "belt": space.belt,
                    "options": space.options_for(driven),
                    "parts": space.parts(driven, effects),
                }
                made = batch_engine(space.engine).prepare_case(driven, travel=far, **asked)
        if made is None:
            without.append(number)
        else:
            alike.setdefault((config["engine"], made.kind), []).append((number, made))
    if without:
        yield without, [None] * len(without)
    for (engine, _), members in alike.items():
        from belt_sim.space.run import Computed

        numbers, ready = zip(*members, strict=True)
        kept, begin = [Computed() for _ in numbers], 0
        watched = [configs[k]["watch"] and engine in WATCHED for k in numbers]
        observers = [[one] if seen else [] for one, seen in zip(kept, watched, strict=True)]
        for some in batch_engine(engine).in_batches(ready, batch, observers):
            found = kept[begin : begin + len(some)]
            for one, curves in zip(found, some, strict=True):
                one.curves = curves
            yield numbers[begin : begin + len(some)], found
            begin += len(some)


def scene(
    case: Case | None = None,
    *,
    tension: Any = None,
    yaw: Any = None,
    yaw_head: Any = None,
    speed: float | None = None,
    direction: float | None = None,
    rig: Any = None,
    belt: Any = None,
    model: ModelSpec = "mujoco_flex",
    effects: Any = None,
) -> "MjSpec":
    """The scene of ``case`` (in SI), or of the case that the settings describe as for ``simulate``, not yet compiled.

    MuJoCo's contacts carry the belt; ``simulate(model={"name": ..., "scene": spec})`` runs it, edited or not. speed
    [m/s]: of the belt; None is as fast as is accurate. effects: as for ``simulate``; what a plain scene cannot have or
    follow is refused.
    """
    given = {"tension": tension, "yaw": yaw, "yaw_head": yaw_head, "speed": speed, "direction": direction}
    return _scene_and_story(case_or_settings(case, given | {"rig": rig, "belt": belt}), model, effects, speed)[0]


def scene_text(case: Case, model: Any, effects: Any = None, speed: float | None = None) -> str:
    """The same as MJCF, commented; speed [m/s]: of the belt, as in the case, or None for as fast as is accurate."""
    from belt_sim.space.mujoco_interface import compile_model, mjcf

    spec, said = _scene_and_story(case, model, effects, speed)
    compile_model(spec)
    return mjcf(spec, said)


def _scene_and_story(case: Case, model: ModelSpec, effects: Any, speed: float | None) -> tuple["MjSpec", str]:
    from belt_sim.space.rolling_contact import build_contact, story

    chosen, acting = model_of(model), effects_of(effects)
    if not isinstance(chosen, SpaceModel):
        raise InputError("model", chosen.name, "", "use mujoco_flex")
    contact = model.get("contact") if isinstance(model, Mapping) else None
    for name, value, wrong, remedy in (
        ("model.contact", contact, contact not in (None, CONTACTS[1]), f"a scene has {CONTACTS[1]}; leave it out"),
        ("engine", chosen.engine, chosen.engine != "native", "leave it out: MuJoCo alone runs a scene"),
        ("model.scene", chosen.scene, chosen.scene is not None, "leave it out: a scene is written of a case"),
    ):
        if wrong:
            raise InputError(name, str(value)[:60], "", remedy)
    refuse_unobeyed(chosen.options, chosen.belt, "scene")
    if speed is not None and chosen.options.belt_speed not in (None, AS_THE_CASE):
        raise InputError("speed", f"{speed:g}", "m/s", "give it or model.belt_speed")
    given = chosen.options if speed is None else replace(chosen.options, belt_speed=AS_THE_CASE)
    chosen = replace(chosen, contact=CONTACTS[1], options=given)
    tighter = replace(case, settings=replace(case.settings, tension=2.0 * case.settings.tension))
    for effect in acting:
        if why := chosen.refusal(effect):
            raise CannotRepresent(f"effects = {effect.id}: {why}; leave it out")
        why, shapes = None, [chosen.parts(x, [effect]) for x in (case, tighter)]
        if overrides(effect) <= {"encoder", "sensor", "sensor_travel"}:
            why = "it changes readings, which a scene does not take; leave it out"
        elif overrides(effect, BEFORE_ENGINE):
            why = "it changes what is asked of the machine, and sliders ask of a scene; give tension or yaw as they are"
        elif any(getattr(shapes[0], part) != getattr(shapes[1], part) for part in ("head", "tail")):
            why = "it follows the tension, which a slider changes; use one of constant size"
        if why:
            raise CannotRepresent(f"effects = {effect.id}: {why}, or use belt-sim simulate")
    options = fit_options(chosen.options, case, chosen.belt, CONTACTS[1])
    spec, laid = build_contact(case, chosen.belt, options, chosen.parts(case, acting))
    slack = [x.words for x in validity_limits(case, chosen, [e.id for e in acting]) if x.words == SLACK_SCENE]
    return spec, "\n     ".join([story(laid).rstrip(), *(f"Mind: {words}." for words in slack)]) + " "


def jax_function(case: Case, model: ModelSpec | None = None, *, travel: float) -> Callable[..., Curves]:
    """A function (case, effects=()) -> true Curves over ``travel`` [m], pure JAX, of cases whose pulleys are like those
    of ``case``: its sums are planned by them. model: None: as ``simulate`` chooses it for ``case``.

    Every number of the case it is given (tension [Pa], yaw [rad], rig, belt: all SI) and of the effects may be traced.
    Wants float64: ``jax.config.update("jax_enable_x64", True)``. Raises CannotRepresent for a model without curves.
    """
    chosen = fitted_model(model_of(model, [case]))
    plan = plan_steps(case, travel=travel, step=chosen.step, keep=chosen.keep)

    def curves(case: Case, effects: Sequence[Effect] = ()) -> Curves:
        chosen.admit(effects)
        return march_traced(case, tuple(effects), travel, model=chosen, plan=plan)

    return curves


def linearise(
    case: Case | None = None,
    *,
    tension: Any = None,
    yaw: Any = None,
    yaw_head: Any = None,
    speed: float | None = None,
    direction: float | None = None,
    rig: Any = None,
    belt: Any = None,
    model: ModelSpec | None = None,
    effects: Any = None,
) -> "LinearBelt | PlantSchedule":
    """The linear plant of ``case`` (in SI), or of the case that the settings describe as for ``simulate``.

    A sequence of tensions [N/mm2] gives a ``PlantSchedule``, a plant at any tension between them, all of one model.
    model: None: as ``simulate`` chooses it. Raises InputError, CannotRepresent.
    """
    from belt_sim.linear.plant import PlantSchedule, linear_belt

    acting, settings = effects_of(effects), {"yaw": yaw, "yaw_head": yaw_head, "speed": speed, "direction": direction}
    many = isinstance(tension, Sequence) and not isinstance(tension, str)
    if many and len(set(tension)) < max(2, len(tension)):
        raise InputError("tension", tension, "N/mm2", "give one, or at least two different ones")
    settings |= {"rig": rig, "belt": belt, "tension": tension[0] if many else tension}
    first = case_or_settings(case, settings)
    ids, cases = [e.id for e in acting], [first]
    if many:
        cases = [replace(first, settings=replace(first.settings, tension=float(t) * N_PER_MM2)) for t in tension]
    chosen = fitted_model(model_of(model, cases, ids))
    plants = [replace(linear_belt(c, chosen, acting), beyond=limits_of_run(c, chosen, acting)) for c in cases]
    return PlantSchedule(tuple(sorted(plants, key=lambda p: p.tension))) if many else plants[0]


def export(
    plant: "LinearBelt",
    folder: Path | str,
    *,
    order: int = 4,
    delay: str = "pade",
    highest: float = 2.0,
    fmu: str | None = "belt.fmu",
    fmi: int = 2,
    libraries: str = "here",
    mat: str | None = "belt.mat",
    config: Any = None,
) -> list[str]:
    """Write ``plant`` into ``folder`` as an FMU, a MAT file, bode.png and plant.json; return what to tell of them.

    order, delay: rational function that replaces each wrapped arc; highest [rad per metre of travel]: up to where its
    error is stated; fmi: 2 or 3; libraries: of the FMU, "here" or "all" (extra ``fmu``); fmu, mat: file names, None for
    no such file; config: for the provenance. Raises InputError before anything is written.
    """
    from belt_sim.linear.fmu import write_fmu
    from belt_sim.linear.plant import plant_json, state_space
    from belt_sim.show.curves import bode_picture

    finite("highest", highest, "rad/m", "give a positive number", lambda x: x > 0)
    for kind, name in (("fmu", fmu), ("mat", mat)):
        if name is not None and not (isinstance(name, str) and Path(name).name == name and name.endswith(f".{kind}")):
            remedy = f"give a file name ending in .{kind} (it is put in the run folder), or null"
            raise InputError(kind, name, "", remedy)
    if fmi not in (2, 3):
        raise InputError("fmi", fmi, "", "use 2 or 3, the version of the FMI standard")
    if libraries not in ("here", "all"):
        raise InputError("libraries", libraries, "", "use here (this system) or all (Linux, macOS and Windows)")
    for key, value, usual in (("fmi", fmi, 2), ("libraries", libraries, "here")):
        if value != usual and not fmu:
            remedy = "is of the FMU, and fmu is null; name its file, fmu=belt.fmu, or leave this out"
            raise InputError(key, value, "", remedy)
    folder = Path(folder)
    metres = state_space(plant, order=order, delay=delay, per_metre=True)
    lines = [
        f"the approximated delay ({delay}, order {order}) changes a response by at most {metres.error(highest):.1e} "
        f"up to {highest:g} rad per metre of travel ({highest * plant.speed:g} rad/s)",
        *filter(None, [warning(plant.model, plant.beyond)]),
    ]
    if fmu:
        path, systems = write_fmu(metres, folder / fmu, fmi, libraries)
        built = f"built for {', '.join(systems)}" if systems else "without a library: no C compiler (cc) was found here"
        lines.append(f"{path}  FMI {fmi}.0, {built}; other systems: build its sources/belt.c")
    if mat:
        lines.append(str(state_space(plant, order=order, delay=delay).save_mat(folder / mat)))
    lines.append(str(bode_picture(folder / "bode.png", metres, float(highest))))
    lines.append(str(write_json(folder / "plant.json", plant_json(metres, float(highest), provenance(config)))))
    return lines
