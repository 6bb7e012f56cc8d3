"""One campaign: drawn and sealed, answered from its folder alone, revealed, and kept as one result file."""

import hashlib
import json
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

from belt_sim.campaign import read_campaign, write_campaign
from belt_sim.errors import InputError
from belt_sim.io import write_json
from belt_sim.virtual_rig.make import HASH, SEALED_FILE, Truth, reveal, seal
from studies.challenge.registry import answerer, source
from studies.challenge.score import CRASH

RESULT = "belt-challenge/1"


@dataclass(frozen=True, kw_only=True)
class Task:
    """One campaign to be answered: its seed, where results go, and how it is drawn and answered.

    advised: advice for a next run is followed in every campaign of this number (0: never).
    """

    seed: int
    out: Path
    source: str = "mix"
    ablation: str = "diagnosis"
    bootstraps: int = 1000
    advised: int = 0
    commit: str | None = None

    @property
    def settings(self) -> dict[str, Any]:
        """What the results of one challenge have in common."""
        return {name: getattr(self, name) for name in ("source", "ablation", "bootstraps")}

    def file(self, kind: str) -> Path:
        """Where a part of this campaign stands: campaigns/SEED, sealed/SEED, answers/SEED.json, results/SEED.json."""
        drawn = kind in ("sealed", "campaigns")
        return self.out / kind / (f"{self.seed}" if drawn else f"{self.seed}.json")


def run_case(task: Task) -> None:
    """Draw, seal, answer, reveal; leaves results/SEED.json whatever happens on the way."""
    spent: dict[str, float] = {}
    try:
        with _stopwatch(spent, "draw"):
            sealed, base = draw(task)
        with _stopwatch(spent, "answer"):
            answer, answer_hash = answer_case(task, base)
        truth = reveal(task.file("sealed"))
        more = _score_further(task, truth, answer, spent)
        more |= {"answer_sha256": answer_hash, "truth_sha256": sealed}
        write_result(task, answer=answer, truth=truth, seconds=spent, **more)
    except Exception as error:  # the generator's, or this package's own: an outcome too, and shown
        write_result(task, answer=crash_answer(error), truth=None, seconds=spent)


def draw(task: Task) -> tuple[str, str]:
    """Leave the campaign in campaigns/SEED, its truth sealed elsewhere before anybody answers.

    One that stands there already is not drawn again. Returns the hash of the truth, and the model that the campaign is
    to be diagnosed with.
    """
    place, folder = task.file("sealed"), task.file("campaigns")
    if folder.exists():
        truth = reveal(place)
        return truth.sha256(), truth.base
    campaign, truth = source(task.source)(task.seed)
    place.mkdir(parents=True, exist_ok=True)
    if (place / HASH).exists():
        if (place / HASH).read_text(encoding="ascii").split()[:1] != [truth.sha256()]:
            raise InputError(f"campaign {task.seed}", "another truth", "", "was sealed earlier; choose another folder")
        if not (place / SEALED_FILE).exists():
            seal(truth, place)
    else:
        seal(truth, place)
    write_campaign(campaign, folder, overwrite=True)  # whole or not at all; a killed run's process may be at it still
    return truth.sha256(), truth.base


def answer_case(task: Task, base: str) -> tuple[dict[str, Any], str]:
    """The answer and its hash; once written it is frozen: a run that goes on after a stop takes it as it stands."""
    place = task.file("answers")
    if not place.exists():
        try:
            answer = answerer(task.ablation)(task.file("campaigns"), task.bootstraps, task.seed, base)
        except Exception as error:  # a crash is an outcome
            answer = crash_answer(error)
        write_json(place, answer)
    text = place.read_text(encoding="utf-8")
    return json.loads(text), hashlib.sha256(text.encode()).hexdigest()


def write_result(
    task: Task, *, truth: Truth | None, answer: dict[str, Any], seconds: dict[str, float], **more: Any
) -> None:
    """Write the result of one campaign."""
    content = {"schema": RESULT, "seed": task.seed, **task.settings, "commit": task.commit}
    content |= {"truth": None if truth is None else asdict(truth), "answer": answer}
    write_json(task.file("results"), content | {"seconds": {k: round(v, 2) for k, v in seconds.items()}} | more)


def crash_answer(error: BaseException | str) -> dict[str, Any]:
    """A crash as an answer."""
    if isinstance(error, str):
        return {"verdict": CRASH, "effects": [], "sentence": error}
    last = traceback.extract_tb(error.__traceback__)[-1:]
    place = "".join(f" ({Path(f.filename).name}:{f.lineno})" for f in last)
    return {"verdict": CRASH, "effects": [], "sentence": f"{type(error).__name__}: {error}{place}"}


def _score_further(task: Task, truth: Truth, answer: dict[str, Any], spent: dict[str, float]) -> dict[str, Any]:
    """What is learnt after the answer is frozen: how small its error could have been, and whether the advised run
    tells."""
    from studies.challenge.oracle import follow, least_error, left_by_named

    more: dict[str, Any] = {}
    folder = task.file("campaigns")
    if answer["verdict"] == CRASH:
        return more
    with _stopwatch(spent, "least"):
        more["least"] = _attempt(lambda: least_error(read_campaign(folder), truth, answer))
        if truth.kind == "outside":
            more["left_by_named"] = _attempt(lambda: left_by_named(read_campaign(folder), truth, answer))
    if task.advised and task.seed % task.advised == 0:
        with _stopwatch(spent, "advice"):
            again = partial(follow, ablation=task.ablation, bootstraps=task.bootstraps)
            more["advice"] = _attempt(lambda: again(folder, truth, answer))
    return more


def _attempt(what: Callable[[], Any]) -> Any:
    """What a function returns, or a crash: it must not cost the answer that is kept already."""
    try:
        return what()
    except Exception as error:
        return {CRASH: crash_answer(error)["sentence"]}


@contextmanager
def _stopwatch(spent: dict[str, float], name: str) -> Iterator[None]:
    """Seconds by the clock, and of the processor as NAME_cpu."""
    began, worked = time.perf_counter(), time.process_time()
    try:
        yield
    finally:
        spent[name], spent[f"{name}_cpu"] = time.perf_counter() - began, time.process_time() - worked
