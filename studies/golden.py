"""Compare what belt-sim writes today with the golden files of tests/golden, or write them anew.

    python -m studies.golden compare                            all parts
    python -m studies.golden compare models imports             those parts
    python -m studies.golden compare diagnoses only=slack_belt  one entry
    python -m studies.golden compare scores count=5             draws and answers the first 5 campaigns of each source
    python -m studies.golden write models                       replaces golden files: look at `git diff` afterwards
    python -m studies.golden compare commands                   exit status, first lines and files of 70 command lines

The word ``exact`` compares every field without a tolerance, as a pure renaming must satisfy. Results are kept in
outputs/golden/COMMIT, so that a comparison that was stopped goes on there. The exit status is 1 if a field differs.
The parts use the command line and the files that it leaves, so that they survive changes inside; scores alone call the
benchmark. CPU time on one core: models 2 min, imports 12 s, commands 40 s, diagnoses 5 min, scores about a minute a
campaign.
"""

import contextlib
import hashlib
import io
import json
import math
import os
import re
import shlex
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from belt_sim.io import CAMPAIGNS
from studies.application import show_help

ROOT = Path(__file__).resolve().parents[1]
GOLDEN = ROOT / "tests" / "golden"
DIGITS = 7  # significant digits of golden numbers
ROWS = 13  # rows of a table that are kept, evenly spaced, the first and the last among them

Json = Any


@dataclass(frozen=True)
class Tolerance:
    """How far a field may be from its golden value: rel of the value (of the largest of a list) plus absolute."""

    fields: str
    rel: float
    absolute: float
    why: str


IGNORED = math.inf
OF_U = 0.05  # share of its u by which a fitted value may be off on another processor
#: The first line that fits a field counts; a field that no line fits must be equal (numbers: to DIGITS digits).
TOLERANCES = (
    Tolerance("*/sentence", 0, IGNORED, "wording is free: verdict and effects are fields of their own"),
    Tolerance("*/note", 0, IGNORED, "wording is free"),
    Tolerance("*/message", 0, IGNORED, "wording is free: that it is refused counts"),
    Tolerance("*/title", 0, IGNORED, "wording is free"),
    Tolerance("models/native*/curves/*", 1e-3, 1e-9, "contacts of a run in time amplify rounding of other processors"),
    Tolerance("models/native*", 1e-3, 1e-9, "the same"),
    Tolerance("models/quasi_static*", 1e-4, 1e-9, "each step's equilibrium is iterated to a residual, not to rounding"),
    Tolerance("models/*", 1e-6, 1e-9, "explicit recursions in float64; the files hold 7 digits"),
    Tolerance("imports/*/rows", 1e-5, 1e-9, "averages over rows; files hold 9 digits"),
    Tolerance("imports/*white*", 1e-3, 1e-6, "an estimate; written to few digits"),
    Tolerance("imports/*wander*", 1e-2, 1e-6, "an estimate; written to few digits"),
    Tolerance("diagnoses/*/value", 1e-3, 0, "fits stop at a change of chi2, well inside u: OF_U of it is allowed too"),
    Tolerance("diagnoses/*/u", 1e-2, 0, "standard errors take derivatives at the fit"),
    Tolerance("diagnoses/*/interval_95", 1e-2, 0, "the same"),
    Tolerance("diagnoses/*threshold*", 2e-2, 0, "follows noise levels that are drawn"),
    Tolerance("diagnoses/*gain*", 1e-3, 0.1, "differences of chi2; decisions ask for 4.6 and more"),
    Tolerance("diagnoses/*unknown_evidence", 1e-2, 1.0, "a maximum over courses of noise; decisions ask for 7"),
    Tolerance("diagnoses/*log_posterior", 1e-3, 1.0, "the same"),
    Tolerance("diagnoses/*held_out_rise", 1e-3, 5e-2, "differences of chi2; decisions ask for 2"),
    Tolerance("diagnoses/*probability*", 0, 3e-2, "exponentials of gains"),
    Tolerance("diagnoses/*sigma*", 1e-2, 1e-2, "separations are read to a tenth"),
    Tolerance("diagnoses/*", 1e-3, 1e-6, "root mean squares and settings that follow the fit"),
    Tolerance("scores/*/suspected", 0, IGNORED, "what is told beside a verdict: whether damage was caught is a field"),
    Tolerance("scores/*/named/*", 0, 0.1, "probabilities are counted in bins of a tenth"),
    Tolerance("scores/*/p", 1.0, 1e-3, "only its size counts"),
    Tolerance("scores/*/removed", 0, 0.05, "shares are told in percent of twenty"),
)


# --- what is computed -------------------------------------------------------------------------------------------------

CURVE_MODELS = "rope,beam_th1,beam_th2,ernst_beam,strip,strip_lift_off"
SHORT = ["rig=rope_example", "tension=60"]
COARSE = ["model.dx=0.04", "model.run_in=0.3"]
QUICK = [*COARSE, "model.settle=0.2", "model.acceleration=3.0"]
BELTS = ("rope", "grid", "flex")  # in three dimensions
#: settings of a run or of a sweep over what stands with commas; every case is one golden entry
RUNS: dict[str, list[str]] = {
    "plain": [f"model={CURVE_MODELS},ritzinger", "tension=7,40", "travel=30"],
    "schedule": [
        f"model={CURVE_MODELS}", "tension=10", "travel=40", "direction=-1", "yaw_head=0.02", "rig.head_radius=0.15",
        "yaw=[{at: 0, yaw: -0.042}, {at: 15, over: 5, yaw: 0.03}]",
    ],
    "effects": [
        "model=beam_th2,strip", "tension=20", "travel=20",
        "effects=[{id: taper, kappa_t: 2.0e-5}, {id: yaw_compliance, c_m: 1e-7}, {id: sensor_gain, g1: 0.02}]",
    ],
    **{f"native_{belt}": [f"model=mujoco_{belt}", *SHORT, *QUICK, "travel=0.2"] for belt in BELTS},
    **{
        f"quasi_static_{belt}": [
            f"model=mujoco_{belt}", *SHORT, *COARSE, "model.steps=2", "travel=1", "engine=quasi_static"
        ] for belt in BELTS
    },
}  # fmt: skip

#: campaign -> the model that it is diagnosed with (made_up_figure_13 has rates alone, which nothing can be told from)
DIAGNOSED = {
    "machine_fault": "strip",
    "slack_belt": "beam_th2",
    "nothing_hidden": "strip",
    "space_nothing": "strip",
    "space_gravity": "beam_th2",
    "space_taper": "strip",
    "made_up_figure_12": "strip",
}
#: fields of diagnosis.json that say when and where, not what
UNSTABLE = ("provenance", "seconds", "admitted")
SCORED = ("mix_9970000", "nothing_7850000", "strangers_6770000")
PER_SOURCE = 20
#: what a scored answer keeps
FACTS = (
    "seed", "source", "kind", "plan", "base", "hidden", "unknown", "dirt", "verdict", "named", "aliases", "outcome",
    "caught", "suspected", "place", "law",
)  # fmt: skip


def models(only: str, folder: Path) -> Iterator[tuple[str, Json]]:
    """summary.json and rows of curves.csv of every case of RUNS."""
    for name, settings in RUNS.items():
        if not fnmatch(name, only):
            continue
        sweep = ["-m"] if any("," in s and "[" not in s for s in settings) else []
        places = [f"hydra.{kind}.dir={folder / name}/{end}" for kind, end in (("run", "run"), ("sweep", ""))]
        command("simulate", *sweep, *settings, "pictures=false", *places)
        for found in sorted(path.parent for path in (folder / name).glob("*/summary.json")):
            model = json.loads((found / "summary.json").read_text())
            key = f"{name} {model['model']} {model['tension_n_per_mm2']:g}"
            curves = found / "curves.csv"
            yield key, {"summary": drop_keys(model, UNSTABLE), "curves": columns(curves) if curves.exists() else None}


def imports(only: str, folder: Path) -> Iterator[tuple[str, Json]]:
    """The campaign that every folder of tests/golden/imports gives, or that it is refused."""
    for given in sorted(p for p in (GOLDEN / "imports").iterdir() if fnmatch(p.name, only)):
        files = sorted(str(p) for p in given.iterdir() if p.name != "mapping.yaml")
        mapping = [f"mapping={given / 'mapping.yaml'}"] if (given / "mapping.yaml").exists() else []
        out = folder / given.name
        asked = [f"out={out}", "overwrite=true", "pictures=false", f"hydra.run.dir={out}_run"]
        status, _, errors = run(["import", *files, *mapping, *asked])
        message = errors.strip().replace(f"{given}/", "").removeprefix("belt-sim: ")
        yield given.name, {"refused": True, "message": message} if status else campaign(out)


def diagnoses(only: str, folder: Path) -> Iterator[tuple[str, Json]]:
    """diagnosis.json of every shipped campaign."""
    for name, model in DIAGNOSED.items():
        if not fnmatch(name, only):
            continue
        out = folder / name
        settings = [f"campaign={CAMPAIGNS / name}", f"model={model}", "seed=0"]
        command("diagnose", *settings, "pictures=false", "watch=null", f"hydra.run.dir={out}")
        yield name, drop_keys(json.loads((out / "diagnosis.json").read_text()), UNSTABLE)


def scores(only: str, folder: Path, count: int = PER_SOURCE) -> Iterator[tuple[str, Json]]:
    """Scored answers to published campaigns, drawn and answered anew: some minutes each on a busy core."""
    from studies.challenge.run_case import Task, run_case
    from studies.challenge.score import score_case

    seen: dict[str, int] = {}
    for name, row in golden("scores").items():
        source = row["source"]
        seen[source] = seen.get(source, 0) + 1
        if not fnmatch(name, only) or seen[source] > count:
            continue
        task = Task(seed=row["seed"], out=folder / source, source=source, bootstraps=400)
        if not task.file("results").exists():
            run_case(task)
        yield name, select_facts(score_case(json.loads(task.file("results").read_text())).row())


#: what differs from run to run: times, processes, versions, hashes of folders' names
UNSTABLE_TEXT = (
    (r"\d{4}-\d\d-\d\d_\d\d-\d\d-\d\d(-\d+)?", "TIME"),
    (r"\d+(\.\d+)? (s|a second)\b", r"N \2"),
    (r"-[0-9a-f]{8}\b", "-HASH"),
    (r"_[0-9a-f]{8}\b", "_HASH"),
    (r"belt-sim \d[\d.]*", "belt-sim VERSION"),
)


def commands(only: str, folder: Path) -> Iterator[tuple[str, Json]]:
    """Exit statuses, first lines of output and errors, and files of every command line that commands.json names.

    The name of an entry is what is typed, in an empty folder; `` ; `` separates commands, ROOT stands for the checkout.
    """
    before = Path.cwd()
    for k, typed in enumerate(golden("commands")):
        if not fnmatch(typed, only):
            continue
        place = folder / str(k)
        place.mkdir(parents=True)
        os.chdir(place)
        try:
            said = [first_lines(part, place) for part in typed.split(" ; ")]
        finally:
            os.chdir(before)
        files = sorted({stable(str(p.relative_to(place)), place) for p in place.rglob("*") if p.is_file()})
        yield typed, {"said": said, "files": files}


def first_lines(typed: str, place: Path) -> Json:
    """Exit status, first line of output and all of the errors' lines of one command."""
    try:
        status, output, errors = run(word.replace("ROOT", str(ROOT)) for word in shlex.split(typed))
    except Exception as error:
        status, output, errors = f"traceback: {type(error).__name__}", "", ""
    told = [line for line in errors.splitlines() if line.strip() and " s left" not in line]
    return [status, stable(next(iter(output.splitlines()), ""), place), [stable(line, place) for line in told]]


def stable(text: str, place: Path) -> str:
    """The text without what differs from run to run."""
    text = text.replace(str(place), "HERE").replace(str(ROOT), "ROOT")
    for pattern, word in UNSTABLE_TEXT:
        text = re.sub(pattern, word, text)
    return text


PARTS: dict[str, Callable[..., Iterator[tuple[str, Json]]]] = {
    "commands": commands,
    "models": models,
    "imports": imports,
    "diagnoses": diagnoses,
    "scores": scores,
}


def published_scores() -> dict[str, Json]:
    """The rows of studies/challenge/stored that are kept: the first of each source; of mix so many of each kind."""
    quota = {"nothing": 3, "library": 7, "two": 4, "outside": 2, "dirty": 3, "below_noise": 1}
    kept: dict[str, Any] = {}
    for name in SCORED:
        rows = json.loads((ROOT / "studies" / "challenge" / "stored" / f"{name}_diagnosis.json").read_text())["rows"]
        left = dict(quota) if name.startswith("mix") else dict.fromkeys(quota, PER_SOURCE)
        for row in rows:
            if left[row["kind"]] > 0 and sum(k.startswith(row["source"]) for k in kept) < PER_SOURCE:
                left[row["kind"]] -= 1
                kept[f"{row['source']}_{row['seed']}"] = select_facts(row)
    return kept


# --- how it is computed -----------------------------------------------------------------------------------------------


def run(words: Iterable[str]) -> tuple[Json, str, str]:
    """Exit status, output and errors of a belt-sim command in this process."""
    from belt_sim.commands.cli import run_command

    output, errors, before, words = io.StringIO(), io.StringIO(), sys.argv, list(words)
    sys.argv = ["belt-sim", *words]
    try:
        with contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors):
            status: Json = run_command(words)
    except SystemExit as end:
        status = end.code
    finally:
        sys.argv = before
    return status, output.getvalue(), errors.getvalue()


def command(*words: str) -> None:
    """A belt-sim command that must succeed."""
    status, _, errors = run(words)
    if status:
        raise SystemExit(f"belt-sim {' '.join(words)}: status {status}\n{errors}")


def columns(path: Path) -> dict[Any, list[float]]:
    """Column -> ROWS of its values."""
    table = pd.read_csv(path)
    return table.iloc[spread([*range(len(table))])].astype(float).to_dict("list")


def campaign(folder: Path) -> Json:
    """Sheet, runs and readings of a campaign folder; of each run's readings ROWS rows and how many there are."""
    content: dict[str, Any] = {"sheet": yaml.safe_load((folder / "campaign.yaml").read_text(encoding="utf-8"))}
    for name in ("runs", "signals", "steady"):
        path = folder / f"{name}.csv"
        if not path.exists():
            continue
        by_run = pd.read_csv(path, dtype=str, keep_default_na=False).map(number).groupby("run", sort=False)
        runs = {run: rows.drop(columns="run").to_dict("list") for run, rows in by_run}
        if name == "runs":
            content["runs"] = {run: {k: v for k, (v,) in row.items()} for run, row in runs.items()}
        else:
            content[name] = {
                run: {"count": len(next(iter(row.values())))} | {k: {"rows": spread(v)} for k, v in row.items()}
                for run, row in runs.items()
            }
    return content


def spread(rows: list[Any]) -> list[Any]:
    """At most ROWS of the rows, evenly spaced."""
    last = len(rows) - 1
    return rows if last < ROWS else [rows[round(k * last / (ROWS - 1))] for k in range(ROWS)]


def number(text: str) -> float | str:
    """A cell as a number, where it is one."""
    try:
        return float(text)
    except ValueError:
        return text


def drop_keys(content: Json, keys: Iterable[str]) -> Json:
    """The content without these keys, at any depth."""
    if isinstance(content, Mapping):
        return {k: drop_keys(v, keys) for k, v in content.items() if k not in keys}
    return [drop_keys(v, keys) for v in content] if isinstance(content, list) else content


def select_facts(row: Mapping[str, Any]) -> Json:
    """What is kept of a scored answer."""
    return {k: row[k] for k in FACTS if k in row}


# --- files ------------------------------------------------------------------------------------------------------------


def golden(part: str) -> dict[str, Json]:
    """Name -> golden content of a part."""
    path = GOLDEN / f"{part}.json"
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}


def write(part: str, content: Mapping[str, Json]) -> None:
    """Replace the golden entries of a part by these; others stay. One line an entry."""
    entries = golden(part) | round_numbers(dict(content))
    lines = [f"{json.dumps(k)}: {json.dumps(v, ensure_ascii=False)}" for k, v in entries.items()]
    (GOLDEN / f"{part}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def round_numbers(content: Json) -> Json:
    """The content with its numbers at DIGITS significant digits."""
    if isinstance(content, Mapping):
        return {str(k): round_numbers(v) for k, v in content.items()}
    if isinstance(content, list):
        return [round_numbers(v) for v in content]
    return float(f"{content:.{DIGITS}g}") if isinstance(content, float) and math.isfinite(content) else content


def work_folder() -> Path:
    """outputs/golden/COMMIT, and of a changed working tree COMMIT-HASH."""
    commit = git("rev-parse", "--short=12", "HEAD")
    changed = git("diff", "HEAD", "--", "belt_sim", "conf", "models")
    mark = "-" + hashlib.sha256(changed.encode()).hexdigest()[:8] if changed else ""
    return ROOT / "outputs" / "golden" / f"{commit}{mark}"


def git(*arguments: str) -> str:
    found = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, check=True)
    return found.stdout.decode(errors="replace").strip()  # loggers' files are in Windows' letters


# --- comparison -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Difference:
    """A field that is not as it was; size: how many times its tolerance, inf where there is none."""

    field: str
    was: Json
    is_now: Json
    size: float = math.inf


def differences(was: Json, now: Json, field: str, exact: bool = False) -> Iterator[Difference]:
    """Every field below ``field`` that differs by more than its tolerance."""
    if isinstance(was, Mapping) and isinstance(now, Mapping):
        if not exact:
            was, now = without_what_u_allows(was, now)
        for key in [*was, *(k for k in now if k not in was)]:
            if key not in now or key not in was:
                if not is_ignored(f"{field}/{key}", exact):
                    yield Difference(f"{field}/{key}", was.get(key, "(absent)"), now.get(key, "(absent)"))
            else:
                yield from differences(was[key], now[key], f"{field}/{key}", exact)
    elif by_id(was) and by_id(now):
        yield from differences(by_id(was), by_id(now), field, exact)
    elif isinstance(was, list) and isinstance(now, list) and len(was) == len(now):
        if all(is_number(v) for v in (*was, *now)):
            yield from number_difference(was, now, field, exact)
        else:
            for k, pair in enumerate(zip(was, now, strict=True)):
                yield from differences(*pair, f"{field}/{k}", exact)
    elif is_number(was) and is_number(now):
        yield from number_difference([was], [now], field, exact)
    elif was != now and not is_ignored(field, exact):
        yield Difference(field, was, now)


def without_what_u_allows(was: Json, now: Json) -> tuple[Json, Json]:
    """Two mappings to compare: a value that is off by a small share of its u is set to what it was, and the numbers of
    an effect that gains no more than chance are left out, as its gain is compared."""
    numbers = [c.get(name) for c in (was, now) for name in ("value", "u")]
    if all(map(is_number, numbers)) and abs(was["value"] - now["value"]) <= OF_U * was["u"]:
        return was, {**now, "value": was["value"]}
    if {"gain", "threshold", "parameters"} <= was.keys() and (
        was["threshold"] is None or was["gain"] <= was["threshold"]
    ):
        return drop_keys(was, ("parameters",)), drop_keys(now, ("parameters",))
    return was, now


def by_id(rows: Json) -> dict[str, Json]:
    """Rows that all have an id, by that id; empty for anything else."""
    named = isinstance(rows, list) and all(isinstance(row, Mapping) and "id" in row for row in rows)
    return {row["id"]: row for row in rows} if named else {}


def number_difference(was: list[float], now: list[float], field: str, exact: bool) -> Iterator[Difference]:
    """The difference of numbers, where it is more than the tolerance of the field."""
    given = tolerance(field)
    rel, absolute = (0.0, 0.0) if given is None or exact else (given.rel, given.absolute)
    largest = max((abs(w) for w in was), default=0.0)
    allowed = max(rel * largest + absolute, 10.0**-DIGITS * largest)
    off = [abs(w - n) for w, n in zip(was, now, strict=True) if not (math.isnan(w) and math.isnan(n))]
    if not all(step <= allowed for step in off):  # a NaN is never below
        yield Difference(field, was, now, max(off) / allowed if allowed else math.inf)


def is_number(value: Json) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def tolerance(field: str) -> Tolerance | None:
    """The tolerance of a field, e.g. diagnoses/slack_belt/effects/0/gain; None: it must be equal."""
    return next((t for t in TOLERANCES if fnmatch(field, t.fields)), None)


def is_ignored(field: str, exact: bool) -> bool:
    given = tolerance(field)
    return not exact and given is not None and given.absolute == IGNORED


def compare(
    part: str, only: str = "*", folder: Path | None = None, exact: bool = False, **more: int
) -> list[Difference]:
    """Differences of a part between its golden file and what is computed now."""
    was = golden(part)
    found: list[Difference] = []
    for name, now in PARTS[part](only, (folder or work_folder()) / part, **more):
        if name not in was:
            found.append(Difference(f"{part}/{name}", "(absent)", "computed"))
        else:
            found.extend(differences(was[name], round_numbers(now), f"{part}/{name}", exact))
    return found


def table(found: Iterable[Difference]) -> str:
    """Differences as lines: field, how many tolerances, golden value, value now."""
    return "\n".join(f"{d.field}  x{d.size:.3g}\n    was {short(d.was)}\n    now {short(d.is_now)}" for d in found)


def short(value: Json) -> str:
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 100 else text[:97] + "..."


def main(arguments: list[str]) -> int:
    """Compare or write the parts that are named; returns the exit status."""
    settings = dict(a.split("=", 1) for a in arguments if "=" in a)
    words = [a for a in arguments if "=" not in a]
    exact = "exact" in words
    action, *parts = [w for w in words if w != "exact"] or ["help"]
    if action not in ("compare", "write") or set(parts) - set(PARTS) or set(settings) - {"only", "count"}:
        print(__doc__)
        return 2
    status = 0
    for part in parts or PARTS:
        more: dict[str, Any] = {"count": int(settings["count"])} if part == "scores" and "count" in settings else {}
        if action == "write":
            kept = published_scores() if part == "scores" else {}
            for name, content in kept.items() if kept else PARTS[part](settings.get("only", "*"), work_folder() / part):
                write(part, {name: content})
            continue
        found = compare(part, settings.get("only", "*"), exact=exact, **more)
        print(table(found) if found else f"{part}: as the golden file says", flush=True)
        status |= bool(found)
    return int(status)


if __name__ == "__main__":
    show_help(__doc__)
    sys.exit(main(sys.argv[1:]))
