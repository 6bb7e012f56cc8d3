"""belt-sim diagnose: which physical effect the model lacks."""

from pathlib import Path
from typing import Any

from belt_sim.commands.laid_out import campaign_from, candidates, model_from
from belt_sim.commands.run_folder import done_before, plain, run_folder
from belt_sim.commands.tell import tell_diagnosis
from belt_sim.errors import InputError
from belt_sim.files import write_json, write_text
from belt_sim.watch.asked import watch_asked

MIN_BOOTSTRAPS = 100


def run(cfg: Any) -> dict[str, Any] | None:
    """Diagnose a campaign and leave diagnosis.json, report.html, effects.yaml and pictures in the run folder."""
    config, folder = plain(cfg), run_folder()
    if done_before(folder, config):
        print(f"done before, kept: {folder}")
        return None
    return diagnose_into(config, folder)


def diagnose_into(config: dict[str, Any], folder: Path) -> dict[str, Any]:
    """The work itself; returns the content of diagnosis.json."""
    count = config["bootstraps"]
    if not isinstance(count, int) or count < MIN_BOOTSTRAPS:
        raise InputError("bootstraps", count, "", f"give a whole number of at least {MIN_BOOTSTRAPS}")
    watch = watch_asked(config["watch"], "auto", "rrd")
    model, campaign = model_from(config), campaign_from(config)
    classes = candidates(config, model)
    admitted = _admit(config, model, classes, campaign)

    from belt_sim.diagnose.describe import describe
    from belt_sim.diagnose.diagnosis import diagnose
    from belt_sim.watch.progress import progress

    with progress(count, f"diagnosing {campaign.title}") as done:
        d = diagnose(
            campaign,
            model,
            classes,
            bootstraps=count,
            seed=int(config["seed"]),
            tell=lambda text: done(0, text),
            tick=lambda n: done(n),
        )
    content = describe(d, seed=int(config["seed"]), config=config)
    if admitted:
        content["admitted"] = admitted
    _leave(d, content, config | {"watch": watch}, folder)
    tell_diagnosis(content, folder)
    return content


def _admit(config, model, classes, campaign) -> list[str]:
    """Test the user's own effects before any long work; returns what the test has to say."""
    own = [c for c in classes if getattr(c, "source_file", None)]
    if not own:
        return []
    from belt_sim.diagnose.admission import admit

    lines = [line for cls in own for line in admit(cls, model, campaign)]
    print("\n".join(lines))
    return lines


def _leave(d, content: dict[str, Any], config: dict[str, Any], folder: Path) -> None:
    from belt_sim.diagnose.drawings import drawings_of
    from belt_sim.diagnose.drawings_file import write_drawings
    from belt_sim.effects.load import save_effects
    from belt_sim.report.report import write_report

    chosen = d.found.chosen
    ids = tuple(e["id"] for e in content["effects"])
    effects = d.bench.forward.effects_at(chosen.q, ids)
    spread = {e["id"]: {n: p["u"] for n, p in e["parameters"].items()} for e in content["effects"]}
    drawn = drawings_of(d)
    write_drawings(folder / "drawings.json", drawn)
    write_text(folder / "effects.yaml", save_effects(effects, spread))
    write_report(folder / "report.html", content, drawn)
    if config["pictures"]:
        draw_pictures(content, drawn, folder)
    if config["watch"] == "rrd":
        from belt_sim.diagnose.recording import record_diagnosis

        record_diagnosis(folder / "comparison.rrd", d)
    write_json(folder / "diagnosis.json", content)


def draw_pictures(content: dict[str, Any], drawn, folder: Path) -> None:
    """The still pictures of a diagnosis."""
    from belt_sim import pictures

    names = {"base": content["base_model"], "final": "with " + ", ".join(e["id"] for e in content["effects"])}
    title = content["campaign"]["title"]
    pictures.overlay_picture(folder / "overlay.png", drawn.overlays, title, names=names)
    worst = content["where"]["worst"]
    first = [p for p in drawn.overlays if p.title.startswith(f"{worst['run']} ")][:2]
    pictures.overlay_picture(folder / "headline.png", first, content["sentence"].split(";")[0], names=names)
    pictures.where_map_picture(folder / "where.png", drawn.maps, title, content["where"]["sentence"])
    pictures.ranking_picture(folder / "ranking.png", content["ranking"], title)
    for k, pair in enumerate(drawn.drifts):
        pictures.drift_chart_picture(folder / f"drift_{k + 1}.png", [pair], title)
