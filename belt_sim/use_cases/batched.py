"""Batched: 3D belts of many configurations, those of one mesh marched at once."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from belt_sim.config import case_from, model_settings
from belt_sim.curves import Curves
from belt_sim.errors import BeltError, RunFailed
from belt_sim.mujoco3d.model import BATCH_ENGINES, SpaceModel, batch_engine
from belt_sim.mujoco3d.options import CONTACTS
from belt_sim.use_cases.asked import effects_of, model_of
from belt_sim.use_cases.simulate import on_engine

Found = Curves | RunFailed | None


def batched(configs: Sequence[Mapping[str, Any]], batch: int | None) -> Iterator[tuple[Sequence[int], Sequence[Found]]]:
    """Numbers of the configurations of a batch, and what it found for each; batch: most cases of one, None: that fit.

    What cannot be marched comes first, with None: its own run says why.
    """
    ready: dict[int, tuple[str, Any]] = {}
    for number, config in enumerate(configs):
        made = _prepared(config)
        if made is not None:
            ready[number] = config["engine"], made
    without = [k for k in range(len(configs)) if k not in ready]
    if without:
        yield without, [None] * len(without)
    alike: dict[Any, list[int]] = {}
    for number, (engine, made) in ready.items():
        alike.setdefault((engine, made.kind), []).append(number)
    for (engine, _), numbers in alike.items():
        begin = 0
        for curves in batch_engine(engine).in_batches([ready[k][1] for k in numbers], batch):
            yield numbers[begin : begin + len(curves)], curves
            begin += len(curves)


def _prepared(config: Mapping[str, Any]) -> Any:
    """The case of a configuration as its own run would march it; None where that refuses it."""
    try:
        model = on_engine(model_of(model_settings(config["model"])), config["engine"])
        if not isinstance(model, SpaceModel) or model.engine not in BATCH_ENGINES:
            return None
        if model.control or model.contact != CONTACTS[0] or config["watch"]:
            return None
        case, effects = case_from(config), effects_of(config["effects"])
        driven, far = model.driven(case, effects, float(config["travel"]))
        parts = model.parts(driven, effects)
        prepared = batch_engine(model.engine).prepared
        return prepared(driven, belt=model.belt, travel=far, options=model.options, parts=parts)
    except BeltError:
        return None
