"""What was understood of a campaign: its machine, its runs, its curves, and what looks damaged."""

from nicegui import ui

from belt_sim import si
from belt_sim.app import plots, widgets
from belt_sim.app.session import Session
from belt_sim.campaign import Campaign, Quantity, Run
from belt_sim.results import words

MACHINE = {"centre_distance": ("pulleys apart", 1.0, "m"), "head_radius": ("head radius", 1.0, "m")}
MACHINE |= {"tail_radius": ("tail radius", 1.0, "m")}
BELT = {
    "width": ("belt width", si.MM, "mm"),
    "thickness": ("belt thickness", si.MM, "mm"),
    "youngs_modulus": ("Young's modulus", 1e9, "GPa"),
    "density": ("density", 1.0, "kg/m³"),
}


def campaign_view(session: Session) -> None:
    """Draw the card of the current campaign; nothing without one."""
    campaign = session.campaign
    if campaign is None or session.importing is not None:
        return
    with widgets.card("2. What was understood", str(campaign)):
        widgets.facts(_facts(campaign), "wide")
        for found in session.suspicions:
            widgets.notice(f"{found.kind.replace('_', ' ')}: {found.sentence}")
        recorded = {r.name: r for r in campaign.runs if r.signals}
        if recorded:
            curves(campaign, recorded)
        if session.taken is not None:
            with ui.element("div").classes("line"):
                ui.button("Change how the files were read", on_click=session.back_to_import).props("flat no-caps dense")
        with ui.expansion("All runs and sensors").classes("w-full"):
            _runs(campaign)
            _signals(campaign)


def curves(campaign: Campaign, recorded: dict[str, Run]) -> None:
    """The curves of one run, to be chosen."""
    first = next(iter(recorded))
    labels = {n: f"{n}: {words.tension(r.tension)} N/mm², yaw {words.yaw(r.yaw)}°" for n, r in recorded.items()}
    chooser = ui.select(labels, value=first, label="run").classes("w-full")
    drawn = ui.plotly(plots.measured(campaign, recorded[first])).props("data-name=measured")
    chooser.on_value_change(lambda e: drawn.update_figure(plots.measured(campaign, recorded[e.value])))


def _facts(campaign: Campaign) -> dict[str, str]:
    """Machine and belt, with their uncertainties."""

    def shown(q: Quantity, size: float, unit: str) -> str:
        return words.with_u(q.value / size, q.u / size, unit)

    machine = {label: shown(getattr(campaign.machine, n), s, u) for n, (label, s, u) in MACHINE.items()}
    if campaign.machine.head_radius == campaign.machine.tail_radius:
        machine = {"pulleys apart": machine["pulleys apart"], "pulley radius": machine["head radius"]}
    return machine | {label: shown(getattr(campaign.belt, n), s, u) for n, (label, s, u) in BELT.items()}


def _runs(campaign: Campaign) -> None:
    rows = []
    for r in campaign.runs:
        travel = words.number(float(r.travel[-1])) if len(r.travel) else words.NONE
        settings = (words.tension(r.tension), words.yaw(r.yaw), words.number(r.speed), f"{r.direction:+g}")
        rows.append((r.name, *settings, travel, str(len(r.travel)), r.repeat_of or "", r.use.replace("_", " ")))
    columns = ("run", "N/mm²", "yaw °", "m/s", "direction", "travel m", "samples", "repeats", "use")
    widgets.table(columns, rows, left=("run", "repeats", "use"))


def _signals(campaign: Campaign) -> None:
    rows = [
        (s.name, s.at.replace("_", " "), *(words.thousandths(v) for v in (s.white, s.zero, s.wander_sd)))
        for s in campaign.signals
    ]
    columns = ("sensor", "place", "noise (mm or mrad)", "zero", "wander")
    widgets.table(columns, rows, left=("sensor", "place"))
