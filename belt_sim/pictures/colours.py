"""Colours that mean the same everywhere, told apart by colour-blind eyes too (after Okabe and Ito, 2008)."""

INK = "#1f2933"
FAINT = "#9aa5b1"
PAPER = "#ffffff"
BLUE = "#0072b2"
SKY = "#56b4e9"
GREEN = "#009e73"
AMBER = "#e69f00"
RED = "#d55e00"
PINK = "#cc79a7"

#: Points 1-4, in this order: the two ends at the tail pulley, the two at the head pulley.
POINTS = (BLUE, AMBER, GREEN, RED)
POINT_NAMES = (
    "1 upper end, tail pulley",
    "2 lower end, tail pulley",
    "3 lower end, head pulley",
    "4 upper end, head pulley",
)

MEASURED = INK
BEFORE = RED
AFTER = BLUE

#: For any further models or runs, in order of use.
CYCLE = (BLUE, RED, GREEN, AMBER, PINK, SKY, "#5d4e9c", "#7a7a2e")

#: Diverging map, blue - white - red, as (position, colour); blue is negative.
DIVERGING = ((0.0, "#16527e"), (0.25, "#6faed6"), (0.5, "#f5f5f2"), (0.75, "#ec9a6a"), (1.0, "#a03a00"))


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green, blue [0..255] of ``#rrggbb``."""
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)


def pale(colour: str) -> str:
    """The same colour, paler: a second curve of its kind."""
    return "#" + "".join(f"{round(0.45 * v + 0.55 * 235):02x}" for v in rgb(colour))
