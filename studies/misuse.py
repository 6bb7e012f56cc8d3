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
from belt_sim.commands.cli import run_command
from belt_sim.errors import BeltError
from belt_sim.io import CAMPAIGNS, ROOT
from studies.application import show_help

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
CHANGES = (
    *("cell", "cell", "factor", "same", "blank", "exchange"),
    *("remove", "spike", "rows", "repeat", "shuffle", "cut"),
)
LETTERS = "\x00\x1b\ufeff\u2028{}[]:,#&*!|>%'\"\n\t -.e0123456789abcé"


@dataclass(frozen=True)
class Case:
    """typed: the command; refused: whether only a refusal is right; words: what was done."""

    typed: list[str]
    words: str
    refused: bool = False


# ---- mutations of text; each takes a random source, so that hypothesis or a seed may drive it


def mutate_table(text: str, rng: random.Random) -> tuple[str, str]:
    """A table with a cell replaced, a column changed, or rows removed, repeated, shuffled or cut off."""
    rows = [line.split(",") for line in text.splitlines()]
    kind, row = rng.choice(CHANGES), rng.randrange(1, len(rows))
    column, other = (rng.randrange(len(rows[0])) for _ in range(2))
    factor = rng.choice(FACTORS)
    if kind == "cell":
        rows[row][column] = _change_word(rows[row][column], rng)
    elif kind == "rows":
        rows = rows[:row] + rows[row + rng.randrange(1, len(rows)) :]
    elif kind == "repeat":
        rows.insert(row, rows[row])
    elif kind == "shuffle":
        rows[1:] = rng.sample(rows[1:], len(rows) - 1)
    elif kind == "remove":
        rows = [r[:column] + r[column + 1 :] for r in rows]
    else:
        first, spiky = rows[1][column], {*rng.sample(range(1, len(rows)), min(4, len(rows) - 1))}
        for k, r in enumerate(rows[1:], 1):
            if kind == "exchange":
                r[column], r[other] = r[other], r[column]
            elif kind != "spike" or k in spiky:
                new = {"factor": _times(r[column], factor), "same": first, "blank": "", "spike": "-9999"}
                r[column] = new.get(kind, r[column])
    text = "\n".join([*(",".join(r) for r in rows), ""])
    words = f"table: {kind}, row {row}, column {column}, {factor:g}"
    return (text[: rng.randrange(len(text))] if kind == "cut" else text), words


def mutate_bytes(text: str, rng: random.Random) -> tuple[str, str]:
    """A text with a piece replaced by random characters."""
    at, length = rng.randrange(len(text)), rng.randrange(20)
    piece = "".join(rng.choice(LETTERS) for _ in range(rng.randrange(1, 12)))
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
            text, words = (mutate_table if sound and rng.random() < 0.8 else mutate_bytes)(text or " ", rng)
        except IndexError:  # rows of several lengths
            text, words = mutate_bytes(text or " ", rng)
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    return f"{file.name} {words}"


# ---- kinds of cases: each fills a folder and names the command


def of_reading(folder: Path, rng: random.Random) -> Case:
    """A damaged campaign, read, looked at, written and read again."""
    return Case(["read", str(folder / "c")], _damage_copy(folder, rng, rng.choice((1, 1, 1, 2, 3))))


def of_campaign(folder: Path, rng: random.Random) -> Case:
    """A damaged campaign or plan, compared with a model, checked, or diagnosed with two candidates."""
    words = _damage_copy(folder, rng, rng.choice((1, 1, 1, 2)))
    command = rng.choice((*["compare"] * 4, "check", "diagnose"))
    typed = [command, f"campaign={folder / 'c'}", "pictures=false"]
    if command == "compare":
        typed.append(f"model={rng.choice(('strip', 'strip', 'beam_th2', 'rope', 'ritzinger'))}")
    elif command == "check":
        if rng.random() < 0.3:
            (folder / "c" / "signals.csv").unlink(missing_ok=True)
        effects = rng.choice(("[taper,yaw_offset]", "[sensor_delay]", "[camber,nonsense]"))
        typed += [f"effects={effects}", "advise=false"]
    else:
        typed += ["effects=[taper,tension_bias]", "bootstraps=100"]
    return Case(typed, words)


def of_slip(folder: Path, rng: random.Random) -> Case:
    """A campaign with a slip that only a refusal is right for."""
    name, old, new = rng.choice(SLIPS)
    file = _copy_campaign(folder) / name
    text = file.read_text(encoding="utf-8")
    assert old in text, old
    file.write_text(text.replace(old, new, 1), encoding="utf-8")
    return Case(["compare", f"campaign={folder / 'c'}", "pictures=false"], f"{old} -> {new}", refused=True)


SLIPS = (
    ("campaign.yaml", "unit: GPa", "unit: mm"),
    ("campaign.yaml", "width:", "widht:"),
    ("campaign.yaml", "value: 200.0", "value: -200.0"),
    ("campaign.yaml", "value: 11.28", "value: 11280"),
    ("campaign.yaml", "value: 0.17,", "value: 170,"),
    ("campaign.yaml", "at: point_1", "at: point_5"),
    ("campaign.yaml", "value: 210.0", "value: nan"),
    ("campaign.yaml", "value: 0.3, u: 0.003", "value: 300, u: 3"),
    ("campaign.yaml", "white: 0.01", "white: 0"),
    ("campaign.yaml", "schema: belt-campaign/1", "schema: belt-campaign/2"),
    ("runs.csv", "yaw_deg", "yaw_mrad"),
    ("runs.csv", "7.0,-0.042", ",-0.042"),
    ("runs.csv", "7.0,-0.042", "7.0,-4.2"),
    ("runs.csv", "r02", "r01"),
    ("runs.csv", "tension_N_per_mm2", "tension"),
    ("runs.csv", ",1,0.0,,fit", ",2,0.0,,fit"),
    ("runs.csv", ",fit", ",maybe"),
    ("runs.csv", "r01,7.0", "r01,7;0"),
    ("signals.csv", "r01,0.5", "r01,-0.5"),
    ("signals.csv", "r01,0.5", "r01,x"),
    ("signals.csv", "travel_m", "travel_mm"),
    ("signals.csv", "r01,0.5", "r77,0.5"),
)


def of_logger(folder: Path, rng: random.Random) -> Case:
    """Damaged files of a logger, imported with a right mapping."""
    files = [folder / f"lauf_0{k}.csv" for k in rng.sample(range(1, 9), 2)]
    for file in files:
        shutil.copy(LOGGERS / file.name, file)
    text = files[0].read_text(encoding="latin-1").replace(",", "\x01").replace(";", ",")
    text, words = mutate_table(text, rng) if rng.random() < 0.8 else mutate_bytes(text, rng)
    files[0].write_bytes(text.replace(",", ";").replace("\x01", ",").encode("utf-8", "surrogatepass"))
    return _import(folder, files, (LOGGERS / "my_rig.yaml").read_text(encoding="utf-8"), words)


def of_mapping(folder: Path, rng: random.Random) -> Case:
    """Right files of a logger with a damaged mapping."""
    tree = yaml.safe_load((LOGGERS / "my_rig.yaml").read_text(encoding="utf-8"))
    columns = ("Zeit [s]", "v Band [m/min]", "Schwenkwinkel [°]", "Bandzug [kN]", "Kante Umlenktrommel [mm]")
    entry = {"role": "signal", "at": "point_1", "unit": "mm", "sign": 1, "factor": 1.0}
    entry |= {"white": "0.01 mm", "zero": "0.1"}
    tree.setdefault("columns", {}).setdefault(rng.choice(columns), entry)
    tree.setdefault("all_runs", {"yaw_at": "5 m", "speed": "0.5 m/s"})
    tree.setdefault("format", {"separator": ";", "decimal": ",", "missing": [-9999]})
    tree, words = mutate_tree(tree, rng)
    return _import(folder, [LOGGERS / f"lauf_0{k}.csv" for k in (1, 2)], yaml.safe_dump(tree, sort_keys=False), words)


def _import(folder: Path, files: list[Path], mapping: str, words: str) -> Case:
    place = folder / "mapping.yaml"
    place.write_text(mapping, encoding="utf-8")
    return Case(["import", *map(str, files), f"mapping={place}", f"out={folder / 'out'}", "pictures=false"], words)


_SOME = [{"id": "taper", "kappa_t": 2e-5}, {"id": "yaw_offset_tail", "beta_0": 1e-4}, {"id": "cant", "gamma": 1e-3}]
EFFECTS = {"schema": "belt-effects/1", "effects": _SOME}


def of_effects(folder: Path, rng: random.Random) -> Case:
    """A damaged effects.yaml."""
    tree, words = mutate_tree(EFFECTS, rng)
    text = yaml.safe_dump(tree, sort_keys=False)
    if rng.random() < 0.3:
        text, words = mutate_bytes(text, rng)
    file = folder / "effects.yaml"
    file.write_text(text, encoding="utf-8", errors="replace")
    return Case(["simulate", f"effects={file}", "travel=2", "pictures=false"], words)


def of_json(folder: Path, rng: random.Random) -> Case:
    """A damaged JSON in the folder of a diagnosis, or of a sweep that is made again."""
    kind = rng.choice(("report", "report", "simulate"))
    copy = shutil.copytree(_right_folder(kind), folder / kind)
    file = rng.choice(sorted(copy.rglob("*.json")))
    text = file.read_text(encoding="utf-8")
    if rng.random() < 0.75:
        tree, words = mutate_tree(json.loads(text), rng)
        text = json.dumps(tree)
    else:
        text, words = mutate_bytes(text, rng)
    file.write_bytes(text.encode("utf-8", "surrogatepass"))
    typed = [kind, f"diagnosis={copy}"] if kind == "report" else [*SWEEP, f"hydra.sweep.dir={copy}"]
    return Case(typed, f"{file.relative_to(folder)}: {words}")


SWEEP = ["simulate", "-m", "tension=10,20", "travel=2", "pictures=false"]


@cache
def _right_folder(kind: str) -> Path:
    """A right folder of a kind, made once."""
    folder = Path(tempfile.mkdtemp(prefix="belt_misuse_")) / kind
    of_report = ["diagnose", "campaign=slack_belt", "effects=[taper]", "pictures=false", f"hydra.run.dir={folder}"]
    outcome, said = finish(Case(of_report if kind == "report" else [*SWEEP, f"hydra.sweep.dir={folder}"], kind), 300.0)
    assert outcome == "ran", said
    return folder


NUMBERS = {
    "simulate": ("tension", "yaw", "yaw_head", "travel", "direction", "speed"),
    "new": ("yaw", "speed", "tensions"),
    "map": ("tension", "travel", "speed"),
    "virtual-rig": ("seed", "plan", "hidden", "base"),
    "export": ("tension", "order", "fmu", "speed"),
}
USUAL = {
    "travel": "2", "tension": "10", "rig.centre_distance": "11.28", "rig.pulley_radius": "0.17", "rig.gravity": "9.81",
    "belt.width": "0.2", "belt.thickness": "0.0003", "belt.youngs_modulus": "2.1e11", "belt.density": "7850",
    "belt.poisson_ratio": "0.3",
}  # fmt: skip


def of_words(folder: Path, rng: random.Random) -> Case:
    """A command with one or two settings that are wrong or out of scale."""
    command = rng.choice(("simulate", *NUMBERS))
    keys = rng.sample((*NUMBERS[command], *(k for k in USUAL if "." in k)), rng.choice((1, 1, 2)))
    typed = [command, *(f"{key}={_change_word(USUAL.get(key, '1'), rng)}" for key in keys)]
    if command == "simulate":
        typed.append(f"model={rng.choice(('strip', 'rope', 'beam_th1', 'beam_th2', 'ritzinger'))}")
    if command in ("simulate", "map"):
        typed += ["pictures=false", *(["travel=2"] if "travel" not in keys else [])]
    if command == "map" and "tension" not in keys:
        typed.append("tension=[7,10]")
    if command in ("new", "virtual-rig"):
        typed.append(f"out={folder / 'out'}")
    return Case(typed, " ".join(typed))


def _copy_campaign(folder: Path) -> Path:
    without = shutil.ignore_patterns("*.sealed", "*.sha256")
    return shutil.copytree(CAMPAIGNS / "slack_belt", folder / "c", ignore=without)


def _damage_copy(folder: Path, rng: random.Random, times: int) -> str:
    campaign = _copy_campaign(folder)
    return "; ".join(mutate_campaign(campaign, rng) for _ in range(times))


#: kind -> what makes its cases, and its share
KINDS: dict[str, tuple[Callable[[Path, random.Random], Case], int]] = {
    "reading": (of_reading, 50),
    "campaign": (of_campaign, 6),
    "slip": (of_slip, 6),
    "logger": (of_logger, 12),
    "mapping": (of_mapping, 14),
    "effects": (of_effects, 4),
    "json": (of_json, 12),
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
    return ("silent", "was accepted") if case.refused else ("ran", out.getvalue())


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
        if not any("hydra" in word for word in case.typed) and case.typed[0] != "read":
            case.typed.append(f"hydra.run.dir={folder / 'run'}")
        outcome, said = finish(case, limit)
        if outcome == "ran" and (wrong := _not_finite(folder)):
            outcome, said = "silent", wrong
    return outcome, said, case


def _not_finite(folder: Path) -> str:
    """A result file with a number that is not finite."""
    for file in folder.rglob("summary.json"):
        text = file.read_text(encoding="utf-8", errors="replace")
        if "NaN" in text or "Infinity" in text:
            return f"{file.name} holds NaN"
    for file in folder.rglob("curves.csv"):
        last = map(_number, file.read_text(encoding="utf-8").strip().splitlines()[-1].split(","))
        if any(x is not None and not math.isfinite(x) for x in last):
            return f"{file.name} ends in nan"
    return ""


def misuse(cases: int = 1000, seed: int = 0, limit: float = LIMIT, kinds: tuple[str, ...] = tuple(KINDS)) -> Counter:
    """Run the cases and print the table; returns (kind, outcome) -> number."""
    found: Counter = Counter()
    began = time.monotonic()
    for k, kind in enumerate(random.Random(seed).choices(kinds, [KINDS[k][1] for k in kinds], k=cases)):
        number = seed * 1_000_000 + k
        outcome, said, case = in_folder(kind, number, limit)
        found[kind, outcome] += 1
        if outcome in BAD:
            print(f"{outcome}: one=[{kind},{number}] {case.words}\n    {said.strip()[-1500:]}", flush=True)
        if k % 100 == 99:
            print(f"# {k + 1} cases, {time.monotonic() - began:.0f} s", flush=True)
    print(f"\n| {'what':10s} | tried | {' | '.join(f'{o:>9s}' for o in OUTCOMES)} |")
    for kind in (*kinds, "all"):
        row = [sum(n for (k, o), n in found.items() if kind in (k, "all") and o == outcome) for outcome in OUTCOMES]
        print(f"| {kind:10s} | {sum(row):5d} | {' | '.join(f'{n:9d}' for n in row)} |")
    return found


def main(arguments: list[str]) -> None:
    """One case again, or so many."""
    given = {key: yaml.safe_load(value) for key, value in (a.split("=", 1) for a in arguments)}
    if "one" in given:
        kind, seed = given["one"]
        outcome, said, case = in_folder(str(kind), int(seed), float(given.get("limit", LIMIT)))
        print(outcome, " ".join(case.typed), case.words, said, sep="\n")
        return
    kinds = tuple(given.get("kinds", KINDS))
    misuse(int(given.get("cases", 1000)), int(given.get("seed", 0)), float(given.get("limit", LIMIT)), kinds)


if __name__ == "__main__":
    show_help(__doc__)
    main(sys.argv[1:])
