"""What the pages ask a reader to type: commands in fenced blocks and in lines of text, and lines of Python.

``<!-- run -->`` before a block has the test suite run it, ``<!-- run: long -->`` only its long half; lines of a block
that are no commands are what it prints. A page may say "`S` stands for `...`" and then write S for it.
"""

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from belt_sim.io import ROOT

PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
PAGES += [ROOT / "studies" / "README.md", ROOT / "models" / "README.md", ROOT / "models" / "campaigns" / "README.md"]
_BLOCK = re.compile(r"(?:<!-- (run|run: long) -->\s*\n)?^```(\w*)\n(.*?)^```", re.MULTILINE | re.DOTALL)
_INLINE = re.compile(r"`([^`]+)`")
_SHORT = re.compile(r"`(\w)` stands\s+for `([^`]+)`")
_TYPED = re.compile(r"^(\.venv/bin/)?(belt-sim [a-z]|python -m (studies|belt_sim)|make [a-z]|pytest )")
SHELL = ("", "bash", "console", "sh")


@dataclass(frozen=True)
class Command:
    """One command of a page: its words, how its block is marked, what it is said to print."""

    page: str
    words: tuple[str, ...]
    marked: str = ""
    output: str = ""

    def __str__(self) -> str:
        return f"{self.page}: {' '.join(self.words)}"


@dataclass(frozen=True)
class Lines:
    """A block of Python of a page."""

    page: str
    code: str
    marked: str
    number: int

    @property
    def prompted(self) -> bool:
        """Whether it is written with prompts and what they answer."""
        return ">>> " in self.code

    def __str__(self) -> str:
        return f"{self.page}, block {self.number}"


def name(path: Path) -> str:
    """A page by its place in the checkout."""
    return str(path.relative_to(ROOT))


def commands(path: Path) -> list[Command]:
    """Every command of a page, in the order of the blocks, those in lines of text last."""
    text = path.read_text(encoding="utf-8")
    found: list[Command] = []
    for marked, language, body in _BLOCK.findall(text):
        if language in SHELL:
            found += _in_block(name(path), marked, body)
    short = dict(_SHORT.findall(text))
    for code in _INLINE.findall(_BLOCK.sub("", text)):
        first, _, rest = " ".join(code.split()).partition(" ")
        line = f"{short[first]} {rest}" if first in short else f"{first} {rest}"
        if _TYPED.match(line):
            found.append(Command(name(path), _words(line)))
    return found


def python(path: Path) -> list[Lines]:
    """Every block of Python of a page."""
    blocks = _BLOCK.findall(path.read_text(encoding="utf-8"))
    lines = [(marked, body) for marked, language, body in blocks if language in ("python", "pycon")]
    return [Lines(name(path), body, marked, k) for k, (marked, body) in enumerate(lines, start=1)]


def _in_block(page: str, marked: str, body: str) -> list[Command]:
    """Commands of a block and what each prints."""
    found: list[Command] = []
    for line in body.replace("\\\n", " ").splitlines():
        typed = line.removeprefix("$ ")
        if _TYPED.match(typed):
            found.append(Command(page, _words(typed), marked))
        elif found and line.strip():
            last = found[-1]
            found[-1] = Command(page, last.words, marked, f"{last.output}{line}\n")
    return found


def _words(line: str) -> tuple[str, ...]:
    """The words of a line as a shell splits them, without where the program lies and without dots left open."""
    words = shlex.split(line.removeprefix(".venv/bin/"), comments=True)
    return tuple(w for w in words if not w.endswith("..."))


_NUMBER = re.compile(r"-?\d+(?:\.(\d+))?(?:[eE][-+]?\d+)?")


def says(wanted: str, got: str) -> bool:
    """Whether two lines are the same, but for a unit in the last place of a number."""
    if _NUMBER.sub("#", wanted).split() != _NUMBER.sub("#", got).split():
        return False
    pairs = zip(_NUMBER.finditer(wanted), _NUMBER.finditer(got), strict=True)
    return all(abs(float(w.group()) - float(g.group())) <= _last_place(w) for w, g in pairs)


def _last_place(number: re.Match[str]) -> float:
    """One unit in the last digit that is written of a decimal number; whole numbers are meant exactly."""
    mantissa, _, power = number.group().lower().partition("e")
    digits = len(mantissa.partition(".")[2])
    return 0.0 if not digits and not power else 1.0001 * 10.0 ** (int(power or 0) - digits)


def missing(wanted: str, got: str) -> list[str]:
    """Lines of ``wanted`` that ``got`` has not, in this order; "..." stands for any lines."""
    lines, lacking = got.splitlines(), []
    for line in wanted.splitlines():
        if line.strip() == "...":
            continue
        at = next((k for k, there in enumerate(lines) if says(line, there)), None)
        if at is None:
            lacking.append(line)
        else:
            lines = lines[at + 1 :]
    return lacking
