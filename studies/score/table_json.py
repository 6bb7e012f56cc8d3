"""A table of evidence as JSON, and back."""

from dataclasses import asdict
from typing import Any

import numpy as np

from studies.score.table import Beyond, Law, Row, Table


def as_json(table: Table) -> dict[str, Any]:
    """What a file keeps of a table."""
    return _plain(asdict(table))


def from_json(content: dict[str, Any]) -> Table:
    """The table that a file kept."""
    rows, beyond = content["rows"], content["beyond"]
    return Table(
        **content | {"rows": tuple(map(_row, rows)), "beyond": tuple(map(_beyond, beyond))} | _ids(content, "steadfast")
    )


def _row(c: dict[str, Any]) -> Row:
    size = len(c["away"])
    gram, sized = np.array(c["gram"], float).reshape(size, size), np.array(c["sized"], dtype=bool)
    numbers = {name: np.array(c[name], float) for name in ("away", "sigma")}
    return Row(**c | numbers | {"gram": gram, "sized": sized, "owner": tuple(c["owner"])} | _ids(c, "ids"))


def _beyond(c: dict[str, Any]) -> Beyond:
    laws = tuple(Law(**law) for law in c["laws"])
    return Beyond(**c | {"courses": np.array(c["courses"], float), "laws": laws} | _ids(c, "beside"))


def _ids(c: dict[str, Any], name: str) -> dict[str, frozenset[str]]:
    return {name: frozenset(c[name])}


def _plain(x: Any) -> Any:
    if isinstance(x, dict):
        return {k: _plain(v) for k, v in x.items()}
    if isinstance(x, frozenset):
        return sorted(x)
    if isinstance(x, np.ndarray | np.generic):
        return x.tolist()
    return [_plain(v) for v in x] if isinstance(x, list | tuple) else x
