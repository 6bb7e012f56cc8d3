"""How plain methods answer the same campaign: least squares that takes readings for independent.

All know the same effects as the diagnosis, each as the change of the readings that it makes (one column a parameter),
and fit a zero to every record. None knows wander, settings, repeats, held-out conditions or an open set.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.simulate import candidates_of, fitted_model
from belt_sim.campaign import Campaign, read_campaign
from belt_sim.diagnosis.forward import Forward, columns, harmonics_of
from belt_sim.diagnosis.samples import samples_of

MOST_EFFECTS = 4
SWEEPS = 10  # of the sparse regression
HALF_WIDTH_95 = 1.96
AWAY = 10.0  # [m] a belt that has run away
_TINY = 1e-12


@dataclass(frozen=True, eq=False)
class Table:
    """Residual of the base model, shape (n,), and change of the readings by one scale of each parameter, (k, n).

    owner: (effect, parameter, scale) of each column; stated: white noise and wander that the file states [m or rad].
    """

    residual: np.ndarray
    columns: np.ndarray
    owner: tuple[tuple[str, str, float], ...]
    stated: float

    def columns_of(self, ids: Sequence[str]) -> list[int]:
        """Columns of some effects that the readings can see."""
        return [k for k, (name, _, _) in enumerate(self.owner) if name in ids and np.abs(self.columns[k]).max() > _TINY]

    def fit(self, chosen: Sequence[int]) -> tuple[np.ndarray, float, np.ndarray]:
        """Least squares on some columns: coefficients, residual sum of squares, covariance of unit noise."""
        if not len(chosen):
            return np.empty(0), float(self.residual @ self.residual), np.empty((0, 0))
        matrix = self.columns[list(chosen)].T
        found = np.linalg.lstsq(matrix, self.residual, rcond=1e-10)[0]
        left = self.residual - matrix @ found
        return found, float(left @ left), np.linalg.pinv(matrix.T @ matrix)


def plain_methods(folder: Path, base: str, answer: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """Name of a method -> its answer, in the form of diagnosis.json as far as scores look at it.

    ``answer`` is the diagnosis' own: two of the methods are its search with a weaker rule, and one refits its set.
    """
    campaign = read_campaign(folder)
    table = table_of(campaign, base)
    count = sum(int(np.isfinite(y).sum()) for run in campaign.runs for y in run.signals.values())
    named = [e["id"] for e in answer["effects"]]
    return {
        "iid_bic": iid_bic(table),
        "sparse": sparse(table),
        "sysid": least_squares_answer(table, named, dict.fromkeys(named, 1.0)) | {"verdict": answer["verdict"]},
        "bic": search_by_bic(answer, count),
        "no_gate": search_without_gate(answer),
    }


def table_of(campaign: Campaign, base: str, effects: Sequence[str] | None = None) -> Table:
    """Residual and columns of a campaign, those of ``effects`` (None: the library); every record less its mean."""
    model, samples = fitted_model(base), samples_of(campaign)
    classes = candidates_of(effects, model)
    free = harmonics_of(classes, samples)
    forward = Forward(samples, model, classes, terms=dict.fromkeys(free, 0))  # what is linear needs no march
    vector = forward.null()
    steps = np.eye(forward.size)[: len(forward.slots)]
    values = forward.values(np.concatenate([vector[None], vector + steps]))
    there = np.isfinite(samples.y)
    with np.errstate(invalid="ignore"):  # a size that lets the belt run away
        changes = np.nan_to_num(values[1:] - values[0], nan=AWAY, posinf=AWAY, neginf=-AWAY).clip(-AWAY, AWAY)
    owner = [(s.effect.id, s.name, s.scale) for s in forward.slots]
    for cls in (c for c in classes if c.is_additive()):
        names = list(cls.parameters)[: 2 * free[cls.id]]
        scales = [cls.parameters[name].scale for name in names]
        shapes = columns(samples, cls)[: len(names)]
        changes = np.concatenate([changes, shapes * np.reshape(scales, (-1, 1, 1, 1))])
        owner += [(cls.id, name, scale) for name, scale in zip(names, scales, strict=True)]
    flat = [_subtract_means(x, there) for x in (samples.y - values[0], *changes)]
    stated = float(np.mean([math.hypot(s.white, s.wander_sd) for s in campaign.signals]))
    return Table(flat[0], np.array(flat[1:]), tuple(owner), stated)


def _subtract_means(x: np.ndarray, there: np.ndarray) -> np.ndarray:
    """Readings (R, S, n) as one vector, each record about its own mean."""
    mean = np.nanmean(np.where(there, x, np.nan), axis=2, keepdims=True, where=there.any(axis=2, keepdims=True))
    return (x - mean)[there]


def iid_bic(table: Table) -> dict[str, Any]:
    """Effects are added while the BIC of independent readings falls; probabilities are its weights."""
    count = len(table.residual)
    chosen: list[str] = []
    sure: dict[str, float] = {}
    best = _bic(table, chosen, count)
    while len(chosen) < MOST_EFFECTS:
        scores = {
            i: _bic(table, [*chosen, i], count) for i in dict.fromkeys(o[0] for o in table.owner) if i not in sure
        }
        name = min(scores, key=lambda i: scores[i])
        if not scores[name] < best:
            break
        weights = [math.exp(-0.5 * min(s - scores[name], 1e3)) for s in (*scores.values(), best)]
        sure[name] = 1.0 / sum(weights)
        best = scores[name]
        chosen.append(name)
    return least_squares_answer(table, chosen, sure)


def _bic(table: Table, ids: Sequence[str], count: int) -> float:
    columns = table.columns_of(ids)
    return count * math.log(table.fit(columns)[1] / count) + len(columns) * math.log(count)


def sparse(table: Table) -> dict[str, Any]:
    """Sequentially thresholded least squares: what moves the readings by less than the stated noise is dropped."""
    kept = table.columns_of([name for name, _, _ in table.owner])
    for _ in range(SWEEPS):
        found = table.fit(kept)[0]
        moves = [abs(c) * np.sqrt(np.mean(table.columns[k] ** 2)) for c, k in zip(found, kept, strict=True)]
        fewer = [k for k, size in zip(kept, moves, strict=True) if size > table.stated]
        if fewer == kept:
            break
        kept = fewer
    names = list(dict.fromkeys(table.owner[k][0] for k in kept))
    return least_squares_answer(table, names, dict.fromkeys(names, 1.0))


def least_squares_answer(table: Table, ids: Sequence[str], sure: Mapping[str, float]) -> dict[str, Any]:
    """A set of effects as an answer; intervals from the scatter that the fit itself leaves."""
    columns = table.columns_of(ids)
    found, left, covariance = table.fit(columns)
    sigma = math.sqrt(left / max(1, len(table.residual) - len(columns)))
    numbers: dict[str, dict[str, Any]] = {name: {} for name in ids}
    for c, k, variance in zip(found, columns, np.diag(covariance), strict=True):
        name, parameter, scale = table.owner[k]
        value, half = float(c) * scale, HALF_WIDTH_95 * sigma * math.sqrt(max(variance, 0.0)) * scale
        numbers[name][parameter] = {"value": value, "interval_95": [value - half, value + half]}
    effects = [{"id": i, "parameters": numbers[i], "probability": sure[i], "confusable_with": []} for i in ids]
    return {"verdict": "explained" if ids else "adequate", "effects": effects}


def search_by_bic(answer: Mapping[str, Any], readings: int) -> dict[str, Any]:
    """The best by BIC of the sets of effects that the diagnosis fitted: no priors, held-out error, plausibility, or
    anything unknown."""
    sets = [e for e in answer.get("considered", ()) if not (e["unknown"] or e["instead"])]
    worth = [e["gain"] - e["parameters"] * math.log(readings) for e in sets]
    best = sets[worth.index(max(worth))]["effects"] if sets else []
    return _answer_of(answer, best)


def search_without_gate(answer: Mapping[str, Any]) -> dict[str, Any]:
    """The likeliest set of effects, named whatever is likelier beyond the library."""
    sets = [e["effects"] for e in answer.get("considered", ()) if not (e["unknown"] or e["instead"] or e["refused"])]
    return _answer_of(answer, sets[0] if sets else [])


def _answer_of(answer: Mapping[str, Any], names: Sequence[str]) -> dict[str, Any]:
    """Effects as an answer, with the diagnosis' own numbers where it names them too."""
    if answer["verdict"] == "cannot_say":  # nothing was searched for: damaged data
        return {"verdict": answer["verdict"], "effects": []}
    known = {e["id"]: e["parameters"] for e in answer["effects"]}
    effects = [{"id": i, "parameters": known.get(i, {}), "probability": 1.0, "confusable_with": []} for i in names]
    return {"verdict": "explained" if names else "adequate", "effects": effects}
