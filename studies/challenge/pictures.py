"""How often answers are right: what was named against what was hidden, and what probabilities are worth."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.show import style
from belt_sim.show.style import AFTER, FAINT, INK, PAPER

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
    names: Sequence[str],
    said: np.ndarray,
    found: np.ndarray,
    low: np.ndarray,
    high: np.ndarray,
    title: str,
) -> Path:
    """Share of named effects that were truly hidden, beside the probability that was said; all (bins,).

    names: of the bins; said: mean probability of a bin; low, high: 95 % interval of the share.
    """
    fig, [[ax]] = style.figure(1.6 + 0.85 * len(names), 4.6)
    at = np.arange(len(names))
    ax.hlines(said, at - 0.36, at + 0.36, color=FAINT, linewidth=2.4, label="probability said, mean")
    bars = np.maximum([found - low, high - found], 0.0)
    ax.errorbar(at, found, yerr=bars, fmt="o", color=AFTER, capsize=3, label="share truly hidden, 95 % interval")
    ax.set_xticks(at, names, fontsize=8)
    ax.set(xlim=(-0.6, len(names) - 0.4), ylim=(0, 1.04), xlabel="probability said; names that were true, of all")
    ax.set_ylabel("probability, share")
    ax.legend(loc="lower right", fontsize=8)
    style.title(fig, title)
    return style.save(fig, path)
