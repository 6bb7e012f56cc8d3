"""Draw the rooms of belt_sim on their floors, from its imports: ``python -m studies.site.architecture``.

A room is a package or a module directly under belt_sim; it stands one floor above the highest room that it imports.
Imports for type checkers and those inside functions count as well, so that no arrow is hidden. Writes
docs/images/architecture.svg, and the table of docs/architecture.md between its marks.
"""

import ast
import re
from collections import defaultdict
from functools import cache
from pathlib import Path

from belt_sim.io import ROOT, write_text
from studies.application import show_help

PACKAGE = ROOT / "belt_sim"
PAGE, PICTURE = ROOT / "docs" / "architecture.md", ROOT / "docs" / "images" / "architecture.svg"
BEGIN, END = "<!-- rooms -->\n", "<!-- end of rooms -->"
WIDTH, HEIGHT, GAP, LEFT = 118, 30, 12, 60  # of a room, between rooms and beside the floors [px]
OUTSIDE = ("__init__", "__main__")  # the names that users import, and the entry


def arrows() -> dict[str, dict[str, list[str]]]:
    """room -> imported room -> files that do so."""
    found: dict[str, dict[str, list[str]]] = defaultdict(lambda: defaultdict(list))
    rooms = {p.relative_to(PACKAGE).parts[0].removesuffix(".py") for p in PACKAGE.rglob("*.py")}
    for path in sorted(PACKAGE.rglob("*.py")):
        own = path.relative_to(PACKAGE).parts[0].removesuffix(".py")
        found[own]  # a room that imports nothing is a room
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            names = []
            if isinstance(node, ast.ImportFrom) and node.module:
                names = [f"{node.module}.{a.name}" for a in node.names] if node.module == "belt_sim" else [node.module]
            elif isinstance(node, ast.Import):
                names = [a.name for a in node.names]
            for name in names:
                if name.startswith("belt_sim.") and (room := name.split(".")[1]) in rooms and room != own:
                    found[own][room].append(str(path.relative_to(ROOT)))
    return {room: dict(to) for room, to in found.items() if room not in OUTSIDE}


def floors(imports: dict[str, dict[str, list[str]]]) -> dict[str, int]:
    """Floor of every room, 0 the lowest; rooms that import each other, by different files, share one."""
    below: dict[str, set[str]] = {}
    for room in imports:
        below[room], ahead = set(), [room]
        while ahead:
            new = set(imports.get(ahead.pop(), {})) - below[room]
            below[room] |= new
            ahead += new
    beside = {room: {room} | {other for other in below[room] if room in below.get(other, ())} for room in imports}

    @cache
    def floor(room: str) -> int:
        lower = {other for one in beside[room] for other in imports.get(one, {})} - beside[room]
        return 1 + max(map(floor, lower), default=-1)

    return {room: floor(room) for room in imports}


def circles(imports: dict[str, dict[str, list[str]]]) -> set[frozenset[str]]:
    """Pairs of rooms that import each other."""
    return {frozenset((a, b)) for a in imports for b in imports[a] if a in imports.get(b, {})}


def about(room: str) -> str:
    """First sentence of a room's docstring."""
    place = PACKAGE / room
    head = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
    doc = ast.get_docstring(ast.parse(head.read_text(encoding="utf-8"))) or ""
    words = re.split(r"(?<=[.:])\s", doc.replace("\n", " "))[0].rstrip(".:")
    return words.split(",")[0] if len(words) > 60 else words


def drawing(imports: dict[str, dict[str, list[str]]], at: dict[str, int]) -> str:
    """An SVG: a row a floor, the lowest at the bottom, a line for every import that skips no drawn neighbour."""
    rows: dict[int, list[str]] = defaultdict(list)
    for room, floor in sorted(at.items()):
        rows[floor].append(room)
    widest, top = max(map(len, rows.values())), max(rows)
    width, height = 2 * LEFT + widest * (WIDTH + GAP), (top + 1) * (HEIGHT + 44) + 20
    place = {}
    for floor, names in rows.items():
        start = (width - len(names) * (WIDTH + GAP) + GAP) / 2
        for k, name in enumerate(names):
            place[name] = (start + k * (WIDTH + GAP), height - 40 - HEIGHT - floor * (HEIGHT + 44))
    lines = []
    for room, to in imports.items():
        direct = set(to) - {far for near in to for far in imports.get(near, {})}
        for other in sorted(direct):
            (x, y), (u, v) = place[room], place[other]
            lines.append(f'<path d="M{x + WIDTH / 2:.0f} {y + HEIGHT:.0f} L{u + WIDTH / 2:.0f} {v:.0f}"/>')
    boxes = []
    for name, (x, y) in place.items():
        boxes.append(
            f'<g><rect x="{x:.0f}" y="{y:.0f}" width="{WIDTH}" height="{HEIGHT}" rx="6"/>'
            f'<text x="{x + WIDTH / 2:.0f}" y="{y + 19:.0f}">{name}</text></g>'
        )
    style = (
        "rect{fill:#f4f7fa;stroke:#0072b2}path{stroke:#9aa5b1;fill:none}text{font:13px sans-serif;"
        "text-anchor:middle;fill:#1f2933}"
    )
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}"><style>{style}</style>'
    ground = f'<rect width="{width}" height="{height}" style="fill:#fff;stroke:none"/>'
    return f"{head}{ground}{''.join(lines)}{''.join(boxes)}</svg>\n"


def table(at: dict[str, int]) -> str:
    """A row a room, the highest floor first."""
    lines = ["| room | what it does |", "| --- | --- |"]
    for room in sorted(at, key=lambda r: (-at[r], r)):
        lines.append(f"| {room} | {about(room)} |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Write the picture and the table."""
    imports = arrows()
    at = floors(imports)
    print(write_text(PICTURE, drawing(imports, at)))
    head, _, rest = PAGE.read_text(encoding="utf-8").partition(BEGIN)
    print(write_text(Path(PAGE), head + BEGIN + table(at) + END + rest.partition(END)[2]))


if __name__ == "__main__":
    show_help(__doc__)
    main()
