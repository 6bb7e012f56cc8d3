"""How a recording opens: the machine large, the time series below it."""

import rerun.blueprint as rrb

from belt_sim.case import Case
from belt_sim.si import MM
from belt_sim.watch.geometry import TRUE, ViewScale, full_colour_tilt
from belt_sim.watch.series import TRAVEL

TRUE_ROOT = "machine/true"
DRAWN_ROOT = "machine/drawn"
PLAY_SPEED = 2000.0  # [mm of travel per second]
#: Behind the machine: a level belt, near white, and a tilted one, dark red or blue, stand out from it.
BACKGROUND = [206, 214, 223]
#: Share of a plot's width, to the right of the curves, that is left to its legend.
WIDE, NARROW = 0.22, 0.32


def space(case: Case, root: str, name: str, look: ViewScale) -> rrb.Spatial3DView:
    """A view of the machine as drawn, from beside and beyond the tail pulley, whose yaw is what matters."""
    length, radius = float(case.rig.centre_distance) / look.shortened, float(case.rig.tail_radius)
    whole = length + 2.0 * radius
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=[0.95 * whole, -0.4 * whole, 0.21 * whole],
        look_target=[0.65 * length, 0.0, -0.3 * radius],
        eye_up=[0.0, 0.0, 1.0],
    )
    return rrb.Spatial3DView(origin=root, name=name, background=BACKGROUND, line_grid=False, eye_controls=eye)


def plot(origin: str, name: str, travel: float, legend: float = NARROW) -> rrb.TimeSeriesView:
    """One plot of time series over all of the ``travel`` [m] to come, its legend to the right of the curves."""
    end = rrb.TimeRangeBoundary.absolute(seq=round(travel / (1.0 - legend) / MM))
    whole = rrb.TimeRange(rrb.TimeRangeBoundary.absolute(seq=0), end)
    return rrb.TimeSeriesView(
        origin=origin,
        name=name,
        plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
        axis_x=rrb.TimeAxis(view_range=whole),
    )


def time_panel() -> rrb.TimePanel:
    """The travel timeline, played at 2 m/s."""
    return rrb.TimePanel(timeline=TRAVEL, fps=PLAY_SPEED, state="collapsed", play_state="following")


def words(case: Case, look: ViewScale) -> str:
    """What is enlarged, and what the colours mean."""
    return f"{look.words()}; colour: tilt, white 0, red/blue +-{full_colour_tilt(case) / 1e-3:.0f} mrad"


def of_run(case: Case, travel: float, look: ViewScale) -> rrb.Blueprint:
    """The machine with its movements enlarged (and, as a tab, true to scale) above the plots."""
    seen = space(case, DRAWN_ROOT, words(case, look), look)
    machine = rrb.Tabs(seen, space(case, TRUE_ROOT, "True to scale", TRUE), active_tab=0)
    loads = rrb.Tabs(
        plot("series/moment", "Entry moment [N m]", travel),
        plot("series/tension", "Tension [N/mm2]", travel),
        plot("series/slip", "Lateral slip [um]", travel),
        plot("series/sag", "Sag [mm]", travel),
        plot("series/further", "Further", travel),
    )
    plots = rrb.Horizontal(
        plot("series/y", "Lateral position y of points 1-4 [mm] over travel [mm]", travel, WIDE),
        plot("series/tilt", "Tilt at mid-span [mrad]", travel),
        loads,
        column_shares=[3, 2, 2],
    )
    body = rrb.Vertical(machine, plots, row_shares=[3, 2])
    return rrb.Blueprint(
        body, time_panel(), rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed")
    )
