"""The terminal: results, the verdict first, in lines that fit the window; how far a run or a diagnosis is; viewers."""

import json
import multiprocessing
import os
import shutil
import sys
import textwrap
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from belt_sim.case import Case
from belt_sim.curves import Curves, Frame, Observer
from belt_sim.errors import InputError
from belt_sim.model import BY_TENSION
from belt_sim.results.words import Table, capital, in_terminal

if TYPE_CHECKING:  # a run of a line model prints lines alone, and does not wait for rich
    from rich.console import Console

    from belt_sim.results.diagnosis import Diagnosis

#: why a model was chosen for one case
REASONS = {"strip_lift_off": "the belt is so slack that it lifts off", "strip": "the belt is too tight to lift off"}


def tell_choice(config: Mapping[str, Any], model: str, why: str = "") -> None:
    """Which model a command has chosen and why, if none was stated."""
    if config["model"]["name"] == BY_TENSION:
        print(f"model {model}, as {why or REASONS[model]}; or model=NAME")


LONGEST_UNBROKEN = 34  # of a run or effect, that its column never breaks


def say(line: object, indent: int = 0) -> None:
    """Print a line of a result, ``indent`` letters from the left: wrapped in a window, in a pipe as it is."""
    space, width = " " * indent, shutil.get_terminal_size().columns
    wrapped = textwrap.TextWrapper(width, space, space, break_on_hyphens=False, break_long_words=False)
    text = in_terminal(line)
    print(wrapped.fill(text) if sys.stdout.isatty() or "COLUMNS" in os.environ else space + text)


def tell(tables: Iterable[Table], lines: Iterable[object]) -> None:
    """Lines of a result, its verdict first, then its tables, then where its files are (a path among the lines).

    Tables have no lines between columns: on a narrow window words wrap in place.
    """
    lines = list(lines)
    for line in (x for x in lines if not isinstance(x, Path)):
        say(line)
    for table in tables:
        from rich import box
        from rich.console import Console
        from rich.table import Table as RichTable
        from rich.text import Text

        look: Any = {"box": box.SIMPLE_HEAD, "pad_edge": False, "collapse_padding": True, "title_justify": "left"}
        shown = RichTable(title=Text(table.title), **look)
        for k, name in enumerate(table.columns):
            left = name in table.left
            whole = not left or (k == 0 and all(len(row[0]) <= LONGEST_UNBROKEN for row in table.rows))
            shown.add_column(Text(name), justify="left" if left else "right", overflow="fold", no_wrap=whole)
        for k, row in enumerate(table.rows):
            shown.add_row(*map(Text, map(in_terminal, row)), style="red" if k in table.marked else None)
        Console(highlight=False).print(shown)
    for path in (x for x in lines if isinstance(x, Path)):
        print(path)


def tell_diagnosis(d: "Diagnosis", folder: Path, *, verbose: bool = False) -> None:
    """Verdict, what takes certainty off it, effects, where the model fails, how the error falls, what to do next;
    verbose: the tables of candidates and of errors as well."""
    from belt_sim.results.diagnosis import SHOWN_ACTIONS, error_line
    from belt_sim.show.report import plant_card, rival_cards

    rivals = rival_cards(d)
    certain = [e for e in d.effects if not rivals or e.id in d.certain_effects]
    cards = [(f"{k}. ", c) for k, c in enumerate(rivals, start=1)]
    cards += [("", plant_card(e, d.drawings.machine, d.asked_for)) for e in certain]
    print()
    say(f"{d.headline}: {d.sentence}")
    for doubt in d.doubts:
        say(capital(doubt), 2)
    for number, c in cards:
        say(f"{number}{c['id'] or 'nothing more'}: {c['fault']}", 2)
        for line in filter(None, (*c["sizes"], c["stamp"], c["sure"])):
            say(line, 5)
    found = d.discovery if d.discovery is not None and d.discovery.found else None
    said = [found.sentence] if found is not None and (d.law_holds or found.law is None) else []
    if d.unknown is not None and (found is None or found.law is None):
        said.append(f"unknown: {d.unknown}")
    elif d.unknown is not None and d.unknown.nearest:
        said.append(f"nearest known effect: {d.unknown.nearest}, but {d.unknown.why}")
    known = (d.where.sentence, d.where.boundary_sentence, *error_line(d.error), *map(str, d.confusables))
    said += map(capital, filter(None, known))
    said += [x if x.startswith("No single") else f"Next: {x}" for x in d.further_runs[:SHOWN_ACTIONS]]
    if d.ranking and not verbose:
        said.append(f"verbose=true lists all {len(d.ranking)} effects that were tried")
    for line in said:
        say(line, 2)
    law = ("found_law.yaml",) if found is not None and found.law_file and d.law_holds else ()
    files = [folder / name for name in ("report.html", "effects.yaml", "diagnosis.json", *law)]
    tell(d.tables() if verbose else (), ["", *files])


# Observers of a run: progress, MuJoCo's own viewer; and whether a way to watch is possible here.
#
# Progress is a bar where somebody looks, a line every 10 % where output goes to a file. The workers of a parallel sweep
# share one terminal: they print lines too, their bars would overwrite one another.

REMEDY = "needs Rerun: pip install 'belt-sim[watch]'"


def resolve_watch(watch: str | None, *choices: str) -> str | None:
    """``watch`` if it is null or one of the choices; raises InputError otherwise, or where Rerun is not installed.

    "auto" stands for "rrd" where Rerun is installed; elsewhere it says so and stands for null.
    """
    if watch is not None and watch not in choices:
        raise InputError("watch", watch, "", f"use null, {' or '.join(choices)}")
    if watch == "viewer":
        if not has_display():
            raise InputError("watch", watch, "", "there is no display here; use watch=rrd")
        return watch
    if watch is None or find_spec("rerun"):
        return "rrd" if watch == "auto" else watch
    if watch == "auto":
        print(f"no recording: it {REMEDY}")
        return None
    raise InputError("watch", watch, "", REMEDY)


def has_display() -> bool:
    """Whether a window can be opened here."""
    return sys.platform in ("darwin", "win32") or any(os.environ.get(v) for v in ("DISPLAY", "WAYLAND_DISPLAY"))


PREPARING, FITTING = "preparing the runs", "fitting sets of effects"
BEYOND_CATALOGUE, LAW_OF_REST = "searching beyond the catalogue", "searching for a law of the rest"
#: stages of a diagnosis in their order -> measured shares of its time in percent; a law, where one is sought, takes
#: with what follows it half as long as all before
STAGES = {
    "": 9.0,
    "checking the machine data": 6.0,
    PREPARING: 27.0,
    "estimating false alarms": 0.3,
    FITTING: 12.0,
    BEYOND_CATALOGUE: 34.0,
    LAW_OF_REST: 40.0,
    "drawing": 4.0,
    "choosing the best further run": 2.0,
}
#: stages of which nobody knows how long the rest takes: the fits take from 0.3 to 6 times as long as all before them
UNFORESEEN = {*list(STAGES)[: list(STAGES).index(BEYOND_CATALOGUE)]}
SOMETIMES = {"checking the machine data", LAW_OF_REST, list(STAGES)[-1]}  # not to come until they begin
LOADING = 3.6  # [s] at most that the first stage counts for in a forecast: effects of one's own may be slow to load
AS_JSON = "BELT_SIM_PROGRESS_AS_JSON"  # environment: progress for a program that reads it, an object a line
LINE_EVERY = 0.10  # share of the work between two lines where there is no terminal


@contextmanager
def progress(
    total: float, title: str, console: "Console | None" = None, *, timed: bool = True
) -> Iterator[Callable[..., None]]:
    """Show how far some work is: ``with progress(n, "bootstrap") as done: ...; done()``, which adds ``amount`` to what
    is done and shows ``note`` beside it. timed: whether the time left can be told from it; else there is a line a note.

    A bar on a terminal of one's own; elsewhere at most a line a tenth of the work, all on standard error.
    """
    from rich.console import Console

    console = console or Console(stderr=True)
    began, count, said = time.monotonic(), 0.0, ""
    bar: Any = None
    if console.is_terminal and multiprocessing.parent_process() is None:
        from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

        share, text = TextColumn("{task.percentage:>3.0f} %"), TextColumn("{task.fields[note]}", markup=False)
        times = (share, text, TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
        words = TextColumn("{task.description}", markup=False), BarColumn(bar_width=None)
        bar = Progress(*words, *(times if timed else times[1:3]), console=console)
        task = bar.add_task(title, total=total, note="")
        bar.start()

    def advance(amount: float = 1.0, note: str = "") -> None:
        nonlocal count, said
        count += amount
        done, elapsed, in_all, more = min(count, total), time.monotonic() - began, 0.0, ""
        if not timed and 0.0 < done < total and note not in UNFORESEEN:  # seconds in all, and what may make them more
            in_all = elapsed / done
            more = ", longer if a law is sought" if note == BEYOND_CATALOGUE else ""
        about = f" of about {in_all:.0f} s{more}" if in_all else ""
        if bar is not None:
            bar.update(task, completed=done, note=f"{note}{about.replace(' of', ',')}")
            return
        now = str(int(done / total / LINE_EVERY + 1e-9) or "" if total > 0 else "") if timed else note
        if now in ("", said):
            return
        said = now
        if os.environ.get(AS_JSON):
            print(json.dumps({"stage": note, "in_all_s": in_all, "more": more}), file=sys.stderr, flush=True)
            return
        parts = [note, f"{elapsed:.0f} s gone{about}"]
        if timed:
            parts = [f"{100 * done / total:3.0f} %", *parts, f"{elapsed * (total / done - 1.0):.0f} s left"]
        line = f"{title}: {', '.join(filter(None, parts))}"
        console.print(line, markup=False, highlight=False, soft_wrap=True)

    try:
        yield advance
    finally:
        if bar is not None:
            bar.stop()


@contextmanager
def stages_shown(title: str) -> Iterator[Callable[[int, str], None]]:
    """A bar for work in stages, as ``in_stages``, where somebody looks: a terminal or a notebook; else nothing."""
    from rich.console import Console

    console = Console()
    if not (console.is_terminal or console.is_jupyter):
        yield lambda count, stage: None
        return
    with progress(1.0, title, console, timed=False) as done:
        yield in_stages(done)


def in_stages(done: Callable[..., None]) -> Callable[[int, str], None]:
    """A diagnosis as work out of 1: ``done`` of ``progress(1.0, ...)`` as (replicates, stage).

    Where a stage begins, what is over is counted by the measured shares of the stages before it, and what is to come by
    those that always follow: of a law, nobody knows before.
    """
    names, began = list(STAGES), time.monotonic()
    over, told, now, slow = 0.0, 0.0, "", 0.0

    def tell(count: int, stage: str) -> None:
        nonlocal over, told, now, slow
        stage = stage or ("drawing" if count else now)
        if stage not in STAGES or stage == now:
            done(0.0, stage)
            return
        elapsed = time.monotonic() - began
        slow = slow if now else max(elapsed - LOADING, 0.0)
        over, now = over + STAGES[now], stage
        to_come = STAGES[stage] + sum(STAGES[n] for n in names[names.index(stage) + 1 :] if n not in SOMETIMES)
        rest = (elapsed - slow) * to_come / over
        share = elapsed / (elapsed + rest) if elapsed > 0.0 else 0.0
        share = share if stage == LAW_OF_REST else max(share, told)
        done(share - told, stage)
        told = share

    return tell


@dataclass
class ProgressObserver:
    """Travel, belt speed and remaining time of a run that is under way, from the first step on, when all is compiled;
    the work is all steps of the run where the engine says how many it has made (``advance``), else the travel."""

    title: str = "belt"
    console: "Console | None" = None
    live_only = True  # of a run that has ended it has nothing to say

    def start(self, case: Case, travel: float) -> None:
        self.travel, self.note, self.counted, self.share = travel, "", False, 0.0
        self.shown = ExitStack()
        self.done: Callable[..., None] | None = None
        self.before: tuple[float, float] | None = None

    def advance(self, share: float, *, counted: bool = True) -> None:
        """Move the bar on: so much of the steps (0 .. 1) has been made; counted: by the engine."""
        self.counted = counted
        self.done = self.done or self.shown.enter_context(progress(1.0, self.title, self.console))
        self.done(share - self.share, self.note)
        self.share = share

    def frame(self, frame: Frame) -> None:
        """Note where the belt is."""
        speed = ""
        if self.before is not None and frame.time > self.before[1]:
            speed = f" at {(frame.travel - self.before[0]) / (frame.time - self.before[1]):.2f} m/s"
        self.before = frame.travel, frame.time
        self.note = f"{frame.travel:.1f} of {self.travel:g} m{speed}"
        if not self.counted:
            self.advance(min(max(frame.travel / self.travel, 0.0), 1.0), counted=False)

    def finish(self, curves: Curves) -> None:
        """End the bar."""
        self.shown.close()


class ViewerObserver(Observer):
    """Shows the scene of a run in the passive viewer, which stays open until it is closed."""

    window: Any = None

    def show(self, model: Any, data: Any) -> None:
        import mujoco.viewer

        self.window = mujoco.viewer.launch_passive(model, data, show_left_ui=False)

    def frame(self, shown: Any) -> None:
        """Draw the belt as it is now, and at the end as it is then: results are written before anybody waits."""
        if self.window is not None and self.window.is_running():
            self.window.sync()

    finish = frame  # type: ignore[assignment]

    def wait(self) -> None:
        """Wait until the window is closed."""
        while self.window is not None and self.window.is_running():
            self.window.sync()
            time.sleep(0.1)
