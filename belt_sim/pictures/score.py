"""How often answers are right: what was named against what was hidden, and what probabilities are worth."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.pictures import style
from belt_sim.pictures.colours import AFTER, FAINT, INK, PAPER

_DARK = 0.55  # share of a row from which its number is written in white


@style.picture
def confusion_picture(
    path: str | os.PathLike, hidden: Sequence[str], named: Sequence[str], counts: np.ndarray, title: str
) -> Path:
    """Campaigns by what they hid (rows) and what was answered (columns), counts (rows, columns); shade: share of a row.

    Where row and column have the same name, the cell is framed.
    """
    total = counts.sum(axis=1, keepdims=True)
    share = counts / np.maximum(total, 1)
    fig, [[ax]] = style.figure(0.36 * len(named) + 3.2, 0.30 * len(hidden) + 2.8)
    ax.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for r, c in np.argwhere(counts > 0):
        ink = PAPER if share[r, c] > _DARK else INK
        ax.text(c, r, f"{counts[r, c]:.0f}", ha="center", va="center", fontsize=8, color=ink)
    for r, name in enumerate(hidden):
        if name in named:
            c = list(named).index(name)
            ax.plot(
                c + np.array([-0.5, 0.5, 0.5, -0.5, -0.5]), r + np.array([-0.5, -0.5, 0.5, 0.5, -0.5]), color=INK, lw=1
            )
    ax.set_xticks(range(len(named)), named, rotation=60, ha="right", rotation_mode="anchor")
    ax.set_yticks(range(len(hidden)), [f"{n} ({t:.0f})" for n, t in zip(hidden, total[:, 0], strict=True)])
    ax.set(xlabel="answered", ylabel="hidden (campaigns)")
    ax.grid(False)
    style.title(fig, title)
    return style.save(fig, path)


@style.picture
def reliability_picture(
    path: str | os.PathLike,
    said: np.ndarray,
    found: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    counts: np.ndarray,
    title: str,
) -> Path:
    """Share of named effects that were truly hidden, against the probability that was said; all arrays (bins,).

    said: mean probability of a bin; low, high: 95 % interval of the share.
    """
    fig, [[ax]] = style.figure(5.2, 4.6)
    ax.plot([0, 1], [0, 1], color=FAINT, linewidth=1.2)
    bars = np.maximum([found - low, high - found], 0.0)
    ax.errorbar(said, found, yerr=bars, fmt="o", color=AFTER, capsize=3)
    for x, y, n in zip(said, found, counts, strict=True):
        ax.annotate(f"{n:.0f}", (x, y), xytext=(7, -4), textcoords="offset points", fontsize=8)
    ax.set(xlim=(0, 1.06), ylim=(0, 1.04), xlabel="probability said", ylabel="share truly hidden, 95 % interval")
    style.title(fig, title)
    return style.save(fig, path)
