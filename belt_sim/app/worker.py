"""A long computation in a process of its own: the request comes as one JSON line, answers go out as JSON lines.

It ends when its standard input ends: whoever asked has gone.
"""

import json
import os
import signal
import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

from belt_sim.errors import BeltError, InputError
from belt_sim.files import write_json

Say = Callable[..., None]
SHOWN = "shown.json"  # what the page shows of a result
NICE = 5  # the page goes first


def main() -> None:
    """Do what the first line of standard input asks for."""
    out = sys.stdout
    if hasattr(os, "nice"):
        os.nice(NICE)

    def say(**message: Any) -> None:
        out.write(json.dumps(message) + "\n")
        out.flush()

    request = json.loads(sys.stdin.readline())
    threading.Thread(target=_leave_with_the_asker, daemon=True).start()
    try:
        with redirect_stdout(sys.stderr):  # what others print goes to the log
            _of_the_library(request["effects"] or [])
            _TASKS[request["task"]](request, say)
        say(finished=True)
    except BeltError as error:
        say(failed=str(error))
    except Exception as error:
        traceback.print_exc()
        say(failed=f"it broke down ({type(error).__name__}: {error}); log.txt in the folder of this result says where")


def _of_the_library(effects: Sequence[Any]) -> None:
    """Raise InputError for effects that are code, wherever they come from."""
    from belt_sim.app.upload import NO_CODE
    from belt_sim.effects.library import library

    for entry in effects:
        name = str(entry["id"] if isinstance(entry, Mapping) else entry)
        if name not in library():
            raise InputError("effects", name, "", NO_CODE)


def _leave_with_the_asker() -> None:
    sys.stdin.read()
    os.kill(os.getpid(), signal.SIGTERM)


def _compare(request: Mapping[str, Any], say: Say) -> None:
    """A comparison into the folder."""
    say(stage="reading")
    from belt_sim.api.inference import compare
    from belt_sim.campaign import read_campaign
    from belt_sim.commands.outputs import write_comparison
    from belt_sim.reports.page import worst

    folder, campaign = Path(request["folder"]), read_campaign(request["campaign"])
    say(stage="computing every run")
    found = compare(campaign, request["model"], request["effects"], config=dict(request))
    say(stage="drawing")
    write_comparison(folder, found, pictures=True)
    tables = [vars(t) for t in found.tables()]
    _leave(
        folder, lines=list(found.lines()), tables=tables, panels=_panels(found), first=worst(found.drawings.overlays)
    )


def _diagnose(request: Mapping[str, Any], say: Say) -> None:
    """A diagnosis into the folder."""
    say(stage="reading")
    from belt_sim.api.inference import diagnose
    from belt_sim.campaign import read_campaign
    from belt_sim.commands.outputs import draw_diagnosis, write_diagnosis

    folder, campaign = Path(request["folder"]), read_campaign(request["campaign"])
    asked = {k: request[k] for k in ("effects", "bootstraps", "seed")}

    def progress(replicates: int, stage: str) -> None:
        say(done=replicates, **({"stage": stage} if stage else {}))

    found = diagnose(campaign, request["model"], **asked, progress=progress, config=dict(request))
    say(stage="drawing")
    write_diagnosis(folder, found)
    draw_diagnosis(folder, found)
    effects = [{"id": e.id, **e.numbers} for e in found.effects if e.source_file is None]
    verdict = {"verdict": str(found.verdict), "headline": found.verdict.headline}
    _leave(folder, **verdict, lines=[found.sentence], effects=effects)


def _panels(found: Any) -> list[dict[str, Any]]:
    """Figures of measured and modelled curves, run by run."""
    from belt_sim.reports import figures

    return [
        {"title": panel.title, "figure": figures.overlay(panel, found.base_model, found.final_model)}
        for panel in found.drawings.overlays
    ]


def _leave(folder: Path, **content: Any) -> None:
    write_json(folder / SHOWN, json.loads(json.dumps(content, default=str)))


_TASKS: Mapping[str, Callable[[Mapping[str, Any], Say], None]] = {"compare": _compare, "diagnose": _diagnose}

if __name__ == "__main__":
    from belt_sim.jax_setup import prepare

    prepare()
    main()
