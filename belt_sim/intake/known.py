"""The mapping as it was used, with everything that was recognised written out, so that an import can be repeated."""

from typing import Any

from belt_sim.intake.mapping import SCHEMA, MappingEntry
from belt_sim.intake.roles import Used
from belt_sim.intake.tracks import Made

#: settings of a run that go into the mapping; what comes from columns is read again
_FROM_FILES = ("its column", "the mean of its column", "travel over time", "the sign of travel or speed", "the step of")


def mapping_used(
    entry: MappingEntry, used: dict[str, tuple[Used, ...]], made: list[Made], step: float
) -> dict[str, Any]:
    """Plain data that ``understand`` accepts."""
    stated = {k: v for k, v in _plain(entry.model_dump(by_alias=True, exclude_unset=True)).items() if k != "schema"}
    columns: dict[str, Any] = {}
    for own in used.values():
        for u in own:
            columns.setdefault(u.column.name, _column(u))
    runs: dict[str, Any] = {}
    for run in made:
        told = {k: v for k, v in run.settings.written.items() if not run.settings.told[k].startswith(_FROM_FILES)}
        told = {k: v for k, v in told.items() if getattr(entry.all_runs, k, None) is None}
        runs[run.key] = told | _plain(run.entry.model_dump(exclude_unset=True))
    out: dict[str, Any] = {"schema": SCHEMA} | stated
    out |= {"columns": columns}
    if runs:
        out["runs"] = runs | {k: v for k, v in stated.get("runs", {}).items() if k not in runs}
    if step > 0.0:
        out["step_m"] = f"{step:g}"
    return out | {"runs": {k: v for k, v in out["runs"].items() if v}} if "runs" in out else out


def in_order(mapping: dict[str, Any]) -> dict[str, Any]:
    """The mapping with its keys in the order in which they are read best."""
    names = [name.rstrip("_") for name in MappingEntry.model_fields]
    return {k: mapping[k] for k in sorted(mapping, key=lambda k: names.index(k) if k in names else len(names))}


def _column(u: Used) -> dict[str, Any]:
    found: dict[str, Any] = {"role": u.role}
    if u.unit and u.role != "ignore":
        found["unit"] = u.unit
    if u.at:
        found |= {"at": u.at, "name": u.name}
    return found | _plain(u.entry.model_dump(exclude_unset=True))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _plain(v) for k, v in value.items() if v is not None}
    return [_plain(v) for v in value] if isinstance(value, list | tuple) else value
