"""Thousands of wrong inputs, and how each ends: python -m studies.misuse cases=1000 seed=0 [limit=60] [kinds=[...]].

Prints a table: tried, ran, refused in words, traceback, hang, silent (accepted although it had to be refused, or a
result that is not finite). Every case that ends in one of the last three is printed with its seed, so that
``one=[KIND,SEED]`` repeats it.
"""

import contextlib
import io
import json
import math
import random
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import yaml

from belt_sim.campaign import read_campaign, suspicions, write_campaign
from belt_sim.cli import run_command
from belt_sim.errors import BeltError
from belt_sim.io import CAMPAIGNS, ROOT

LIMIT = 60.0  # [s] without an answer that count as a hang
LOGGERS = ROOT / "models" / "loggers"
OUTCOMES = ("ran", "refused", "traceback", "hang", "silent")
BAD = OUTCOMES[2:]
#: What people and programs write where a number belongs.
WORDS = (
    *("", "null", "~", "nan", "inf", "-inf", "1e400", "1_0", "0x10", "1,5", "ten", "true", "[]", "{}", "[1, 2]"),
    *("-1", "0", "1e-300", "1e300", "999999999999", "-0.0", "٣", "'5'", "5 mm", "\u2028", "\x1b[31m", "a" * 300),
)
FACTORS = (-1.0, 0.0, 1e-6, 1e-3, 0.1, 0.3048, 0.5, 2.0, 3.28, 10.0, 25.4, 1e3, 1e6)


@dataclass(frozen=True)
class Case:
    """typed: the command; refused: whether only a refusal is right; fresh: whether only a new result is; words: what
    was done."""

    typed: list[str]
    words: str
    refused: bool = False
    fresh: bool = False


# ---- mutations of text; each takes a random source, so that hypothesis or a seed may drive it


def mutate_cell(text: str, rng: random.Random) -> tuple[str, str]:
    """A table with one cell replaced by a word or a multiple of its number."""
    lines = text.splitlines()
    row = rng.randrange(len(lines))
    cells = lines[row].split(",")
    column = rng.randrange(len(cells))
    before = cells[column]
    cells[column] = _change_word(before, rng)
    lines[row] = ",".join(cells)
    return "\n".join([*lines, ""]), f"row {row} cell {column}: {before} -> {cells[column][:30]!r}"


def mutate_column(text: str, rng: random.Random) -> tuple[str, str]:
    """A table with one column of numbers multiplied, made constant, blanked, exchanged or removed."""
    rows = [line.split(",") for line in text.splitlines()]
    column, kind = rng.randrange(len(rows[0])), rng.choice(("factor", "same", "blank", "exchange", "remove", "spike"))
    name, factor, other = rows[0][column], rng.choice(FACTORS), rng.randrange(len(rows[0]))
    spiky = set(rng.sample(range(1, len(rows)), min(4, len(rows) - 1)))
    for k, row in enumerate(rows[1:], 1):
        if kind == "factor":
            row[column] = _times(row[column], factor)
        elif kind == "same":
            row[column] = rows[1][column]
        elif kind == "blank":
            row[column] = ""
        elif kind == "exchange":
            row[column], row[other] = row[other], row[column]
        elif kind == "spike" and k in spiky:
            row[column] = "-9999"
    if kind == "remove":
        rows = [row[:column] + row[column + 1 :] for row in rows]
    return "\n".join([*(",".join(row) for row in rows), ""]), f"column {name}: {kind} {factor:g}"


def mutate_rows(text: str, rng: random.Random) -> tuple[str, str]:
    """A table with rows removed, repeated, shuffled, or cut off in the middle."""
    lines, kind = text.splitlines(), rng.choice(("remove", "repeat", "shuffle", "cut", "only"))
    head, rows = lines[0], lines[1:]
    if kind == "remove":
        start = rng.randrange(len(rows))
        rows = rows[:start] + rows[start + rng.randrange(1, len(rows) + 1) :]
    elif kind == "repeat":
        k = rng.randrange(len(rows))
        rows = [*rows[: k + 1], *rows[k:]]
    elif kind == "shuffle":
        rng.shuffle(rows)
    elif kind == "only":
        rows = rows[: rng.randrange(1, 4)]
    text = "\n".join([head, *rows, ""])
    return (text[: rng.randrange(len(text))] if kind == "cut" else text), f"rows: {kind}"


def mutate_bytes(text: str, rng: random.Random) -> tuple[str, str]:
    """A text with a piece replaced by random characters."""
    at, length = rng.randrange(len(text)), rng.randrange(20)
    piece = "".join(
        rng.choice("\x00\x1b\ufeff\u2028{}[]:,#&*!|>%'\"\n\t -.e0123456789abcé") for _ in range(rng.randrange(1, 12))
    )
    return text[:at] + piece + text[at + length :], f"text at {at}: {piece!r}"


def mutate_tree(tree: object, rng: random.Random) -> tuple[object, str]:
    """Plain data with one node replaced, removed, renamed, nested or multiplied."""
    places: list[tuple] = []

    def walk(node: object, path: tuple) -> None:
        places.append(path)
        for key, inner in node.items() if isinstance(node, dict) else enumerate(node) if isinstance(node, list) else ():
            walk(inner, (*path, key))

    tree = json.loads(json.dumps(tree))
    walk(tree, ())
    path = rng.choice(places[1:] or places)
    if not path:
        return rng.choice(([], None, 1, "text")), "the whole"
    node = tree
    for key in path[:-1]:
        node = node[key]  # type: ignore[index]
    key, before = path[-1], node[path[-1]]  # type: ignore[index]
    kind = rng.choice(("value", "value", "value", "remove", "rename", "nest", "deep"))
    if kind == "remove" or (kind == "rename" and isinstance(node, list)):
        del node[key]  # type: ignore[attr-defined]
    elif kind == "rename":
        node[f"{key}x"] = node.pop(key)  # type: ignore[index, attr-defined]
    elif kind == "nest":
        node[key] = rng.choice(([before], {"value": before}, [], {}, [None]))  # type: ignore[index]
    elif kind == "deep":
        for _ in range(60):
            before = [before]
        node[key] = before  # type: ignore[index]
    else:
        word = _change_word(f"{before}" if isinstance(before, int | float) else "x", rng)
        number = _number(word)
        node[key] = rng.choice((None, True, word, word if number is None else number, -1, 0, 1e300))  # type: ignore[index]
    shown = node[key] if kind == "value" else ""  # type: ignore[index]
    return tree, f"{'.'.join(map(str, path))}: {kind} {str(shown)[:30]!r}"


def _change_word(before: str, rng: random.Random) -> str:
    return rng.choice(WORDS) if rng.random() < 0.5 else _times(before, rng.choice(FACTORS))


def _times(cell: str, factor: float) -> str:
    number = _number(cell)
    return cell if number is None else repr(number * factor)


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


TABLE = (mutate_cell, mutate_cell, mutate_column, mutate_column, mutate_rows, mutate_bytes)


def mutate_campaign(folder: Path, rng: random.Random) -> str:
    """Damage one file of a campaign folder (its sheet in structure or in text); returns what was done."""
    file = rng.choice(sorted(p for p in folder.iterdir() if p.suffix in (".csv", ".yaml")))
    text = file.read_text(encoding="utf-8", errors="replace")
    tree = None
    with contextlib.suppress(yaml.YAMLError):
        tree = yaml.safe_load(text) if file.suffix == ".yaml" and rng.random() < 0.8 else None
    if isinstance(tree, dict) and tree:
        tree, words = mutate_tree(tree, rng)
        text = yaml.safe_dump(tree, sort_keys=False)
    else:  # of a table that an earlier change has broken, only the text
        sound = file.suffix == ".csv" and len(text.splitlines()) > 3
        try:
            text, words = rng.choice(TABLE if sound else (mutate_bytes,))(text or " ", rng)
        except IndexError:  # rows of several lengths
            text, words = mutate_bytes(text or " ", rng)
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    return f"{file.name} {words}"


# ---- kinds of cases: each fills a folder and names the command


def of_campaign(folder: Path, rng: random.Random) -> Case:
    """A damaged campaign, compared with a model."""
    words = _damage_copy(folder, rng, rng.choice((1, 1, 1, 2, 3)))
    model = rng.choice(("strip", "strip", "beam_th2", "rope", "ritzinger"))
    return Case(["compare", f"campaign={folder / 'c'}", f"model={model}", "pictures=false"], words)


def of_reading(folder: Path, rng: random.Random) -> Case:
    """A damaged campaign, read, looked at, written and read again."""
    return Case(["read", str(folder / "c")], _damage_copy(folder, rng, rng.choice((1, 1, 1, 2, 3))))


def of_check(folder: Path, rng: random.Random) -> Case:
    words = _damage_copy(folder, rng, 1)
    if rng.random() < 0.3:
        (folder / "c" / "signals.csv").unlink(missing_ok=True)
        words += "; a plan"
    effects = rng.choice(("[taper,yaw_offset]", "[sensor_delay]", "[camber,cant,nonsense]"))
    typed = ["check", f"campaign={folder / 'c'}", f"effects={effects}", "pictures=false", "advise=false"]
    return Case(typed, f"{words}; {effects}")


def of_diagnosis(folder: Path, rng: random.Random) -> Case:
    """A damaged or contradictory campaign, diagnosed with two candidates."""
    words = _damage_copy(folder, rng, 1, mutate_column if rng.random() < 0.6 else None)
    typed = ["diagnose", f"campaign={folder / 'c'}", "effects=[taper,tension_bias]", "bootstraps=100"]
    return Case([*typed, "pictures=false"], words)


def of_logger(folder: Path, rng: random.Random) -> Case:
    """Damaged files of a logger, imported with a right mapping."""
    names = [f"lauf_0{k}.csv" for k in rng.sample(range(1, 9), 2)]
    words = []
    for name in names:
        shutil.copy(LOGGERS / name, folder / name)
    file = folder / names[0]
    text = file.read_text(encoding="latin-1").replace(",", "\x01").replace(";", ",")
    text, said = rng.choice(TABLE)(text, rng)
    words.append(f"{file.name} {said}")
    file.write_bytes(text.replace(",", ";").replace("\x01", ",").encode("utf-8", "surrogatepass"))
    mapping = folder / "mapping.yaml"
    shutil.copy(LOGGERS / "my_rig.yaml", mapping)
    files = [str(folder / n) for n in names]
    return Case(["import", *files, f"mapping={mapping}", f"out={folder / 'out'}", "pictures=false"], "; ".join(words))


def of_mapping(folder: Path, rng: random.Random) -> Case:
    """Right files of a logger with a damaged mapping."""
    tree = yaml.safe_load((LOGGERS / "my_rig.yaml").read_text(encoding="utf-8"))
    columns = ("Zeit [s]", "v Band [m/min]", "Schwenkwinkel [°]", "Bandzug [kN]", "Kante Umlenktrommel [mm]")
    entry = {"role": "signal", "at": "point_1", "unit": "mm", "sign": 1, "factor": 1.0} | {
        "white": "0.01 mm",
        "zero": "0.1",
    }
    tree.setdefault("columns", {}).setdefault(rng.choice(columns), entry)
    tree.setdefault("all_runs", {"yaw_at": "5 m", "speed": "0.5 m/s"})
    tree.setdefault("format", {"separator": ";", "decimal": ",", "missing": [-9999]})
    tree, words = mutate_tree(tree, rng)
    mapping = folder / "mapping.yaml"
    mapping.write_text(yaml.safe_dump(tree, sort_keys=False), encoding="utf-8")
    files = [str(LOGGERS / f"lauf_0{k}.csv") for k in (1, 2)]
    return Case(["import", *files, f"mapping={mapping}", f"out={folder / 'out'}", "pictures=false"], words)


_SOME = [{"id": "taper", "kappa_t": 2e-5}, {"id": "yaw_offset_tail", "beta_0": 1e-4}, {"id": "cant", "gamma": 1e-3}]
EFFECTS = {"schema": "belt-effects/1", "effects": _SOME}


def of_effects(folder: Path, rng: random.Random) -> Case:
    """A damaged effects.yaml."""
    tree, words = mutate_tree(EFFECTS, rng)
    file = folder / "effects.yaml"
    text = yaml.safe_dump(tree, sort_keys=False)
    if rng.random() < 0.3:
        text, more = mutate_bytes(text, rng)
        words += f"; {more}"
    file.write_text(text, encoding="utf-8", errors="replace")
    return Case(["simulate", f"effects={file}", "travel=2", "pictures=false"], words)


def of_json(folder: Path, rng: random.Random) -> Case:
    """A damaged JSON in a folder that is read: a run, a diagnosis, a sealed truth."""
    kind = rng.choice(("diagnosis", "diagnosis", "run"))
    shutil.copytree(_right_folder(kind), folder / kind)
    files = sorted((folder / kind).rglob("*.json"))
    file = rng.choice(files)
    text = file.read_text(encoding="utf-8")
    if rng.random() < 0.75:
        tree, words = mutate_tree(json.loads(text), rng)
        text = json.dumps(tree)
    else:
        text, words = mutate_bytes(text, rng)
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    typed = {
        "diagnosis": ["report", f"diagnosis={folder / kind}"],
        "run": ["simulate", "-m", "tension=10,20", "travel=2", "pictures=false", f"hydra.sweep.dir={folder / kind}"],
    }
    return Case(typed[kind], f"{file.relative_to(folder)}: {words}")


def of_resume(folder: Path, rng: random.Random) -> Case:
    """A sweep that is made again after its campaign, its effects or a result has changed."""
    campaign, runs, effects = _copy_campaign(folder), folder / "runs", folder / "effects.yaml"
    effects.write_text(yaml.safe_dump(EFFECTS), encoding="utf-8")
    typed = ["compare", "-m", f"campaign={campaign}", "model=strip,beam_th2", f"effects={effects}"]
    typed += ["pictures=false", f"hydra.sweep.dir={runs}"]
    outcome, said = finish(Case(typed, "first"), LIMIT)
    assert outcome == "ran", said
    of_sweep = {p.relative_to(runs) for p in runs.rglob("*.json")}
    before = [p.read_bytes() for p in sorted(folder.rglob("*.*")) if p.is_file()]
    kind = rng.choice(("readings", "runs", "effects", "result", "damage"))
    if kind == "effects":
        effects.write_text(yaml.safe_dump(EFFECTS).replace("2.0e-05", "3.0e-05"), encoding="utf-8")
    elif kind == "result":
        file = runs / rng.choice(sorted(of_sweep))
        file.write_text(mutate_bytes(file.read_text(encoding="utf-8"), rng)[0], encoding="utf-8", errors="replace")
    elif kind == "damage":
        kind = mutate_campaign(campaign, rng)
    else:
        file = campaign / ("signals.csv" if kind == "readings" else "runs.csv")
        rows = file.read_text(encoding="utf-8").splitlines()
        cells = rows[5].split(",")
        cells[-1 if kind == "readings" else 2] = "0.3" if kind == "readings" else "0.05"
        file.write_text("\n".join([*rows[:5], ",".join(cells), *rows[6:], ""]), encoding="utf-8")
    after = [p.read_bytes() for p in sorted(folder.rglob("*.*")) if p.is_file()]
    return Case(typed, f"resume: {kind}", fresh=before != after)


@cache
def _right_folder(kind: str) -> Path:
    """A right folder of a kind, made once."""
    folder = Path(tempfile.mkdtemp(prefix="belt_misuse_")) / kind
    typed = {
        "diagnosis": ["diagnose", "campaign=slack_belt", "effects=[taper]", f"hydra.run.dir={folder}"],
        "map": ["map", "tension=[7,10]", "travel=2", f"out={folder}"],
        "run": ["simulate", "-m", "tension=10,20", "travel=2", f"hydra.sweep.dir={folder}"],
    }
    outcome, said = finish(Case([*typed[kind], "pictures=false"], "undamaged"), 300.0)
    if outcome != "ran":
        raise RuntimeError(f"{kind} could not be made: {said}")
    return folder


NUMBERS = {
    "simulate": ("tension", "yaw", "yaw_head", "travel", "direction", "speed"),
    "new": ("yaw", "speed", "tensions"),
    "map": ("tension", "travel", "speed"),
    "virtual-rig": ("seed", "plan", "hidden", "base"),
    "export": ("tension", "order", "fmu", "speed"),
}
MACHINE = (
    *("rig.centre_distance", "rig.pulley_radius", "rig.gravity", "belt.width", "belt.thickness"),
    *("belt.youngs_modulus", "belt.density", "belt.poisson_ratio"),
)
USUAL = {"travel": "2", "tension": "10", "centre_distance": "11.28", "pulley_radius": "0.17", "gravity": "9.81"} | {
    "width": "0.2", "thickness": "0.0003", "youngs_modulus": "2.1e11", "density": "7850", "poisson_ratio": "0.3"
}  # fmt: skip


def of_words(folder: Path, rng: random.Random) -> Case:
    """A command with one or two settings that are wrong or out of scale."""
    command = rng.choice(("simulate", "simulate", "new", "map", "virtual-rig", "export"))
    typed = [command]
    for key in rng.sample((*NUMBERS[command], *MACHINE), rng.choice((1, 1, 2))):
        typed.append(f"{key}={_change_word(USUAL.get(key.split('.')[-1], '1'), rng)}")
    given = {t.split("=")[0] for t in typed}
    if command == "simulate":
        typed += [f"model={rng.choice(('strip', 'rope', 'beam_th1', 'beam_th2', 'ritzinger'))}", "pictures=false"]
    if command in ("simulate", "map") and "travel" not in given:
        typed.append("travel=2")
    if command == "map":
        typed += ["pictures=false", *(["tension=[7,10]"] if "tension" not in given else [])]
    if command in ("new", "virtual-rig", "map"):
        typed.append(f"out={folder / 'out'}")
    return Case(typed, " ".join(typed))


def of_refusals(folder: Path, rng: random.Random) -> Case:
    """A campaign with a slip that only a refusal is right for."""
    _copy_campaign(folder)
    sheet, runs = folder / "c" / "campaign.yaml", folder / "c" / "runs.csv"
    slips: list[tuple[Path, str, str]] = [
        (sheet, "unit: GPa", "unit: mm"),
        (sheet, "width:", "widht:"),
        (sheet, "value: 200.0", "value: -200.0"),
        (sheet, "value: 11.28", "value: 11280"),
        (sheet, "value: 0.17,", "value: 170,"),
        (sheet, "at: point_1", "at: point_5"),
        (sheet, "value: 210.0", "value: nan"),
        (sheet, "value: 0.3, u: 0.003", "value: 300, u: 3"),
        (sheet, "white: 0.01", "white: 0"),
        (sheet, "schema: belt-campaign/1", "schema: belt-campaign/2"),
        (runs, "yaw_deg", "yaw_mrad"),
        (runs, "7.0,-0.042", ",-0.042"),
        (runs, "7.0,-0.042", "7.0,-4.2"),
        (runs, "r02", "r01"),
        (runs, "tension_N_per_mm2", "tension"),
        (runs, ",1,0.0,,fit", ",2,0.0,,fit"),
        (runs, ",fit", ",maybe"),
        (runs, "r01,7.0", "r01,7;0"),
        (folder / "c" / "signals.csv", "r01,0.5", "r01,-0.5"),
        (folder / "c" / "signals.csv", "r01,0.5", "r01,x"),
        (folder / "c" / "signals.csv", "travel_m", "travel_mm"),
        (folder / "c" / "signals.csv", "r01,0.5", "r77,0.5"),
    ]
    file, old, new = rng.choice(slips)
    text = file.read_text(encoding="utf-8")
    assert old in text, old
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    return Case(["compare", f"campaign={folder / 'c'}", "pictures=false"], f"{old} -> {new}", refused=True)


def _copy_campaign(folder: Path) -> Path:
    campaign = folder / "c"
    campaign.mkdir()
    for path in (CAMPAIGNS / "slack_belt").glob("*.*"):
        if path.suffix in (".csv", ".yaml"):
            shutil.copy(path, campaign / path.name)
    return campaign


def _damage_copy(folder: Path, rng: random.Random, times: int, column: Callable | None = None) -> str:
    campaign = _copy_campaign(folder)
    if column is not None:
        file = campaign / rng.choice(("runs.csv", "signals.csv"))
        text, words = column(file.read_text(encoding="utf-8"), rng)
        file.write_text(text, encoding="utf-8")
        return f"{file.name} {words}"
    return "; ".join(mutate_campaign(campaign, rng) for _ in range(times))


#: kind -> what makes its cases, and its share
KINDS: dict[str, tuple[Callable[[Path, random.Random], Case], int]] = {
    "reading": (of_reading, 50),
    "campaign": (of_campaign, 4),
    "slip": (of_refusals, 6),
    "check": (of_check, 1),
    "diagnosis": (of_diagnosis, 1),
    "logger": (of_logger, 12),
    "mapping": (of_mapping, 14),
    "effects": (of_effects, 4),
    "json": (of_json, 12),
    "resume": (of_resume, 2),
    "words": (of_words, 4),
}


# ---- running


class NoAnswer(BaseException):
    """The time is up."""


def finish(case: Case, limit: float) -> tuple[str, str]:
    """How a case ends: outcome, and what was said."""

    def stop(*_: object) -> None:
        raise NoAnswer

    out, err = io.StringIO(), io.StringIO()
    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, limit)
    argv, sys.argv = sys.argv, ["belt-sim"]
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            status = _read_again(Path(case.typed[1])) if case.typed[0] == "read" else run_command(case.typed)
    except NoAnswer:
        return "hang", f"no answer in {limit:g} s"
    except (Exception, SystemExit):
        return "traceback", traceback.format_exc()
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
        sys.argv = argv
    said = err.getvalue().strip()
    if "Traceback" in said or "Traceback" in out.getvalue():
        return "traceback", said or out.getvalue()
    if status != 0:
        return ("refused", said) if "belt-sim: " in said else ("silent", f"status {status} without a word: {said}")
    if case.refused:
        return "silent", "was accepted"
    if case.fresh and out.getvalue().count("kept") > 1:
        return "silent", out.getvalue()
    return "ran", out.getvalue()


def _read_again(folder: Path) -> int:
    """0 if a campaign can be read, looked at, written and read again with the same numbers; 1 if it is refused."""
    try:
        campaign = read_campaign(folder)
    except BeltError as error:
        print(f"belt-sim: {error}", file=sys.stderr)
        return 1
    again = write_campaign(campaign, folder.with_name("again"))
    assert repr(again) == repr(campaign)
    assert [s.sentence for s in suspicions(again)] == [s.sentence for s in suspicions(campaign)]
    for one, other in zip(campaign.runs, again.runs, strict=True):
        assert all(np.allclose(y, other.signals[n], rtol=1e-12, equal_nan=True) for n, y in one.signals.items())
    return 0


def in_folder(kind: str, seed: int, limit: float) -> tuple[str, str, Case]:
    """Make and run one case in a folder of its own."""
    rng = random.Random(f"{kind} {seed}")
    with tempfile.TemporaryDirectory(prefix="belt_misuse_") as place:
        folder = Path(place)
        case = KINDS[kind][0](folder, rng)
        if not any("hydra" in word for word in case.typed) and case.typed[0] not in ("map", "read"):
            case.typed.append(f"hydra.run.dir={folder / 'run'}")
        outcome, said = finish(case, limit)
        if outcome == "ran" and (wrong := _not_finite(folder)):
            outcome, said = "silent", wrong
    return outcome, said, case


def _not_finite(folder: Path) -> str:
    """A result file with a number that is not finite."""
    for file in folder.rglob("summary.json"):
        with contextlib.suppress(ValueError):
            if "NaN" in (text := file.read_text(encoding="utf-8")) or "Infinity" in text:
                return f"{file.name} holds NaN"
    for file in folder.rglob("curves.csv"):
        last = map(_number, file.read_text(encoding="utf-8").strip().splitlines()[-1].split(","))
        if any(x is not None and not math.isfinite(x) for x in last):
            return f"{file.name} ends in nan"
    return ""


def misuse(cases: int = 1000, seed: int = 0, limit: float = LIMIT, kinds: tuple[str, ...] = tuple(KINDS)) -> Counter:
    """Run the cases and print the table; returns (kind, outcome) -> number."""
    shares = [KINDS[k][1] for k in kinds]
    chosen = random.Random(seed).choices(kinds, shares, k=cases)
    found: Counter = Counter()
    began = time.monotonic()
    for k, kind in enumerate(chosen):
        outcome, said, case = in_folder(kind, seed * 1_000_000 + k, limit)
        found[kind, outcome] += 1
        if outcome in BAD:
            print(
                f"{outcome}: one=[{kind},{seed * 1_000_000 + k}] {case.words}\n    {said.strip()[-1500:]}", flush=True
            )
        if k % 100 == 99:
            print(f"# {k + 1} cases, {time.monotonic() - began:.0f} s", flush=True)
    print(f"\n| {'what':10s} | tried | {' | '.join(f'{o:>9s}' for o in OUTCOMES)} |")
    for kind in (*kinds, "all"):
        row = [sum(n for (k, o), n in found.items() if kind in (k, "all") and o == outcome) for outcome in OUTCOMES]
        print(f"| {kind:10s} | {sum(row):5d} | {' | '.join(f'{n:9d}' for n in row)} |")
    return found


def main(arguments: list[str]) -> None:
    given = {key: yaml.safe_load(value) for key, value in (a.split("=", 1) for a in arguments)}
    if "one" in given:
        kind, seed = given["one"]
        outcome, said, case = in_folder(str(kind), int(seed), float(given.get("limit", LIMIT)))
        print(outcome, " ".join(case.typed), case.words, said, sep="\n")
        return
    kinds = tuple(given.get("kinds", KINDS))
    misuse(int(given.get("cases", 1000)), int(given.get("seed", 0)), float(given.get("limit", LIMIT)), kinds)


if __name__ == "__main__":
    main(sys.argv[1:])
