"""Where the CPU time of a diagnosis goes: ``python -m studies.bench.flame CAMPAIGN,MODEL PICTURE CHECKOUT...``.

Each checkout diagnoses beneath py-spy (``pip install py-spy``); to see it warm, diagnose once before. One flame graph
each, all on one scale of seconds: a box is a function, what stands on it was called by it.
"""

import os
import re
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from belt_sim.io import write_with
from studies.application import show_help

#: the command, which leaves the CPU time of all its threads
TIMED = """
import atexit, runpy, time
atexit.register(lambda: open("cpu", "w").write(str(time.process_time())))
runpy.run_module("belt_sim", run_name="__main__", alter_sys=True)
"""
RATE = 50  # samples a second
DEPTH, LEAST = 16, 0.004  # rows that are drawn, and the least share of a box
LIBRARIES = {"jax", "jaxlib", "numpy", "scipy", "matplotlib", "pandas", "rerun"}
HIDDEN = {"__call__", "call", "<lambda>", "<listcomp>", "<dictcomp>", "<genexpr>", "<module>", "in_style", "main"}
HIDDEN |= {"run_command", "run_hydra", "apply_hydra", "run_task", "carry_out", "diagnose_command", "run"}


def record(tree: Path, campaign: str, model: str) -> tuple[Counter[tuple[str, ...]], float]:
    """Samples of every stack of the package's own functions, with the library in which it ends; and CPU seconds."""
    spied = ["py-spy", "record", "-r", str(RATE), "-f", "raw", "-o", "stacks", "--", sys.executable, "-c", TIMED]
    command, found = [*spied, "diagnose", f"campaign={campaign}", f"model={model}"], Counter[tuple[str, ...]]()
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"PYTHONPATH": str(tree.resolve())}
        subprocess.run(command, cwd=folder, env=environment, check=True, capture_output=True)
        seconds = float((Path(folder) / "cpu").read_text())
        for line in (Path(folder) / "stacks").read_text().splitlines():
            called, _, count = line.rpartition(" ")
            frames = called.split(";")
            if re.match(r"(_worker|wait) \((concurrent/futures/thread|threading)\.py", frames[-1]):
                continue  # a thread that waits, which py-spy takes for one at work where others load the machine
            own = [f for f in frames if re.search(r"\((\S*/)?belt_sim/", f)]
            names = [f.partition(" (")[0].rpartition(".")[2] for f in own]
            stack = [n for k, n in enumerate(names) if n not in HIDDEN and (not k or n != names[k - 1])]
            last = re.sub(r".*?\((?:\S*site-packages/)?", "", frames[-1]).partition("/")[0]
            if any("importlib" in f for f in frames):
                stack = ["imports"]
            elif last in LIBRARIES:
                stack.append(last)
            found[tuple(stack) or ("Python",)] += int(count)
    return found, seconds


def draw(axes: Axes, stacks: Counter[tuple[str, ...]], seconds: float, longest: float) -> None:
    """Draw boxes of all stacks, the widest first, in seconds; longest: of all graphs [s]."""
    total, least = sum(stacks.values()), LEAST * sum(stacks.values())

    def boxes(left: float, depth: int, within: Counter[tuple[str, ...]]) -> None:
        widths = Counter[str]()
        for stack, count in within.items():
            widths[stack[0]] += count
        for name, count in widths.most_common():
            if count < least or depth == DEPTH:
                continue
            width = count / total * seconds
            shade = 0.35 + 0.5 * (sum(map(ord, name)) % 17) / 17
            axes.barh(depth, width, 0.92, left, color=(0.95, shade, 0.25), edgecolor="white", linewidth=0.3)
            if (letters := int(width / longest * 190)) > 3:
                axes.text(left + longest / 600, depth, name[:letters], va="center", fontsize=5, clip_on=True)
            above = Counter({s[1:]: n for s, n in within.items() if s[0] == name and len(s) > 1})
            boxes(left, depth + 1, above)
            left += width

    boxes(0.0, 0, stacks)
    axes.set(ylim=(-0.6, DEPTH), yticks=[])
    axes.spines[["top", "right", "left"]].set_visible(False)


def main() -> None:
    """Record, draw, write."""
    if len(sys.argv) < 4 or "," not in sys.argv[1]:
        print(__doc__, file=sys.stderr)
        sys.exit(2)
    asked, picture, *trees = sys.argv[1:]
    campaign, model = asked.split(",")
    figure = Figure(figsize=(9.0, 2.6 * len(trees) + 0.4), layout="constrained")
    panels = figure.subplots(len(trees), 1, sharex=True, squeeze=False)[:, 0]
    made = [record(Path(tree), campaign, model) for tree in trees]
    for axes, tree, (stacks, seconds) in zip(panels, trees, made, strict=True):
        draw(axes, stacks, seconds, max(s for _, s in made))
        version = ["git", "-C", tree, "log", "-1", "--format=version of %cs, %h"]
        said = subprocess.run(version, check=True, capture_output=True, text=True).stdout.strip()
        axes.set_title(f"{campaign}, {said}: {seconds:.0f} CPU s", loc="left", fontsize=8)
    panels[-1].set_xlabel("CPU time [s]", fontsize=8)
    write_with(Path(picture), lambda path: figure.savefig(path, dpi=150))


if __name__ == "__main__":
    show_help(__doc__)
    main()
