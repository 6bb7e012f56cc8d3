"""Fig. 9: the rope and the beam of 1st order bound all curves of the beam of 2nd order."""

from pathlib import Path

from belt_sim.show import style
from belt_sim.show.style import FAINT, RED
from studies.paper import drawing
from studies.paper.models import LOOKS, TRAVEL, moving, y_mm
from studies.paper.plate import Plate, column

NUMBER, TITLE = 9, "Comparison of models"
TENSIONS = (1.0, 10.0, 40.0, 100.0, 1000.0, 10000.0)  # [N/mm2] of the beam of 2nd order
BOUNDS = ("rope", "beam_th1")


def plate(in_space: bool = True) -> Plate:
    """y of point 1 on the test rig by the paper's three models."""
    numbers = {"travel_m": column(moving("rope", 40.0).travel)}
    numbers |= {f"{model}_y1_mm": column(y_mm(moving(model, 40.0).y[0])) for model in BOUNDS}
    numbers |= {f"beam_th2_{t:g}_N_per_mm2_y1_mm": column(y_mm(moving("beam_th2", t).y[0])) for t in TENSIONS}
    caption = (
        "Run-up point 1, belt 200 x 0.3 mm, test rig, yaw -0.042 degrees. At low tension the beam of 2nd order runs "
        "into that of 1st order, at very high tension into the rope (10 000 N/mm2 is no belt's: it shows the limit)."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers))


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, [[ax]] = style.figure(8.0, 5.0)
    s = n["travel_m"]
    ax.fill_between(s, n["beam_th1_y1_mm"], n["rope_y1_mm"], color=FAINT, alpha=0.18, linewidth=0)
    for k, tension in enumerate(TENSIONS):
        y = n[f"beam_th2_{tension:g}_N_per_mm2_y1_mm"]
        shade = 0.35 + 0.65 * k / (len(TENSIONS) - 1)
        ax.plot(s, y, color=RED, alpha=shade, linewidth=1.3, label="beam, 2nd order" if k == 3 else None)
        _name(ax, y[-1], f"{tension:g}")
    for model in BOUNDS:
        ax.plot(s, n[f"{model}_y1_mm"], linewidth=2.2, **LOOKS[model].line)
    drawing.zero_line(ax)
    ax.annotate("N/mm²", (TRAVEL, ax.get_ylim()[1]), xytext=(5, 0), textcoords="offset points", va="top", color=RED,
                annotation_clip=False)  # fmt: skip
    ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel="lateral position y of point 1 [mm]", xlim=(0.0, TRAVEL))
    ax.legend(loc="upper left")
    style.title(fig, f"{TITLE}: point 1, test rig")
    return style.save(fig, path)


def _name(ax, at: float, words: str) -> None:
    """The tension at the end of its curve."""
    ax.annotate(words, (TRAVEL, at), xytext=(5, 0), textcoords="offset points", va="center", color=RED,
                fontsize=style.FONT - 1, annotation_clip=False)  # fmt: skip
