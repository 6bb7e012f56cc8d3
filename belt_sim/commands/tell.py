"""Results as tables in the terminal."""

from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

MIN_WIDTH = 110


def _console() -> Console:
    out = Console(highlight=False)
    out.width = max(out.width, MIN_WIDTH)
    return out


def tell_diagnosis(content: dict[str, Any], folder: Path) -> None:
    """Verdict, where it fails, effects, ranking, errors, next runs."""
    out = _console()
    out.print(f"\n[bold]{content['verdict']}[/bold]: {content['sentence']}")
    out.print(content["where"]["sentence"])
    out.print(content["where"]["boundary_sentence"])
    for s in content["suspicions"]:
        out.print(f"[yellow]{s['kind']}[/yellow] {s['sentence']}")
    for e in content["effects"]:
        _tell_effect(out, e)
    out.print(_ranking(content["ranking"]))
    _tell_errors(out, content["error"])
    for pair in content["confusables"]:
        out.print(f"{pair['a']} cannot be told apart from {pair['b']} ({pair['sigma']:.1f} sigma)")
    for a in content["next_runs"][:3]:
        change = f"{a['sigma_before']:.1f} -> {a['sigma_after']:.1f} sigma"
        out.print(f"next run: {a['action']} tells {' from '.join(a['separates'])}: {change}")
    if content["unknown"]:
        out.print(f"unknown: {_card(content['unknown'])}")
    out.print("")
    for name in ("report.html", "effects.yaml", "diagnosis.json"):
        out.print(str(folder / name), soft_wrap=True)


def _tell_effect(out: Console, e: dict[str, Any]) -> None:
    numbers = ", ".join(f"{n} = {p['value']:.4g} +- {p['u']:.2g} {p['unit']}" for n, p in e["parameters"].items())
    alike = f"; confusable with {', '.join(e['confusable_with'])}" if e["confusable_with"] else ""
    stamp = f" ({e['stamp']})" if "stamp" in e else ""
    out.print(f"  [bold]{e['id']}[/bold]: {numbers}; probability {e['probability']:.2f}{alike}{stamp}")


def _ranking(rows: list[dict[str, Any]]) -> Table:
    table = Table(title="candidates", title_justify="left")
    for name in ("effect", "chi2 gain", "threshold", "held-out rms mm", "plausible", "note"):
        table.add_column(name, justify="left" if name in ("effect", "note") else "right")
    for r in rows:
        threshold = "-" if r["threshold"] is None else f"{r['threshold']:.1f}"
        plausible = "yes" if r["plausible"] else "no"
        table.add_row(r["id"], f"{r['gain']:.1f}", threshold, f"{r['held_out_rms_mm']:.4f}", plausible, r["note"])
    return table


def _tell_errors(out: Console, error: dict[str, Any]) -> None:
    table = Table(title=f"error (noise floor {error['noise_floor_mm']:.3f} mm)", title_justify="left")
    for name in ("rms in mm", "before", "after"):
        table.add_column(name, justify="right")
    for name in ("fit", "held_out"):
        table.add_row(name, f"{error[name]['before_mm']:.4f}", f"{error[name]['after_mm']:.4f}")
    for name, row in error.get("held_out_by_condition", {}).items():
        table.add_row(f"without {name}", f"{row['before_mm']:.4f}", f"{row['after_mm']:.4f}")
    out.print(table)


def _card(card: dict[str, Any]) -> str:
    parts = [f"parity {card['parity']}"]
    parts += [f"tension exponent {card['tension_exponent']:.1f}"] if card["tension_exponent"] is not None else []
    parts += [f"onset {card['onset_m']:.1f} m"] if card["onset_m"] is not None else []
    parts += [f"wavelength {card['wavelength_m']:.2f} m"] if card["wavelength_m"] is not None else []
    parts += [f"nearest {card['nearest']}: {card['why']}"] if card["nearest"] else []
    return "; ".join(parts)


def tell_comparison(content: dict[str, Any], folder: Path) -> None:
    """Error of every run and signal, before and after, and where the model fails."""
    out = _console()
    after = content["effects"] or None
    table = Table(title=f"{content['base_model']} against {content['campaign']['title']}", title_justify="left")
    for name in (
        "run",
        "signal",
        "N/mm2",
        "yaw deg",
        "use",
        "rms mm",
        "with effects",
        "floor",
        "late rate",
        "measured",
    ):
        table.add_column(name, justify="right")
    for row in content["per_run"]:
        style = "red" if row["worse"] else None
        cells = [row["run"], row["signal"], f"{row['tension']:g}", f"{row['yaw_deg']:+.3g}", row["use"]]
        cells += [
            f"{row['before_mm']:.4f}",
            f"{row['after_mm']:.4f}" if after else "-",
            f"{row['floor_mm']:.4f}",
        ]
        cells += [_rate(row["modelled"]), _rate(row["measured"])]
        table.add_row(*cells, style=style)
    out.print(table)
    out.print(content["where"]["sentence"])
    out.print(content["where"]["boundary_sentence"])
    if after:
        e = content["error"]
        names = ", ".join(x["id"] for x in after)
        for name, row in e.items():
            if isinstance(row, dict):
                out.print(f"{name}: rms {row['before_mm']:.4f} -> {row['after_mm']:.4f} mm with {names}")
        out.print(f"noise floor {e['noise_floor_mm']:.4f} mm")
        worse = [f"{r['run']} {r['signal']}" for r in content["per_run"] if r["worse"]]
        out.print(f"got worse: {', '.join(worse)}" if worse else "no run got worse")
    out.print(folder)


def _rate(features: dict[str, Any]) -> str:
    rate = features["late_rate_mm_per_m"]
    return "-" if rate is None else f"{rate:+.4f}"
