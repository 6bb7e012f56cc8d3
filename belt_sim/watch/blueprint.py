"""How a recording opens: the machine large, the time series below it."""

import rerun.blueprint as rrb

from belt_sim.case import Case
from belt_sim.si import MM
from belt_sim.watch.series import TRAVEL
from belt_sim.watch.shape import full_colour_tilt

TRUE = "machine/true"
DRAWN = "machine/drawn"
PLAY_SPEED = 2000.0  # [mm of travel per second]
BACKGROUND = [252, 252, 250]


def space(case: Case, root: str, name: str) -> rrb.Spatial3DView:
    """A view of the machine from beyond the tail pulley, whose yaw is what matters."""
    a, radius = float(case.rig.centre_distance), float(case.rig.tail_radius)
    near = 0.11 * a + 10.0 * radius
    eye = rrb.EyeControls3D(
        kind=rrb.Eye3DKind.Orbital,
        position=[a + 0.02 * near, -0.66 * near, 0.33 * near],
        look_target=[a - 0.62 * near, 0.0, -0.4 * radius],
        eye_up=[0.0, 0.0, 1.0],
    )
    so_far = rrb.VisibleTimeRange(
        TRAVEL, start=rrb.TimeRangeBoundary.infinite(), end=rrb.TimeRangeBoundary.cursor_relative()
    )
    return rrb.Spatial3DView(
        origin=root,
        name=name,
        background=BACKGROUND,
        line_grid=False,
        eye_controls=eye,
        overrides={f"{root}/trail": [rrb.VisibleTimeRanges([so_far])]},
    )


def plot(origin: str, name: str, travel: float) -> rrb.TimeSeriesView:
    """One plot of time series over all of the ``travel`` [m] to come."""
    whole = rrb.TimeRange(
        rrb.TimeRangeBoundary.absolute(seq=0), rrb.TimeRangeBoundary.absolute(seq=round(1.02 * travel / MM))
    )
    legend = rrb.PlotLegend(corner=rrb.Corner2D.LeftBottom)
    return rrb.TimeSeriesView(origin=origin, name=name, plot_legend=legend, axis_x=rrb.TimeAxis(view_range=whole))


def time_panel() -> rrb.TimePanel:
    """The travel timeline, played at 2 m/s."""
    return rrb.TimePanel(timeline=TRAVEL, fps=PLAY_SPEED, state="collapsed", play_state="following")


def of_run(case: Case, travel: float, scale: float) -> rrb.Blueprint:
    """The machine with its movements enlarged (and, as a tab, true to scale) above four plots."""
    full = full_colour_tilt(case) / 1e-3
    drawn = f"Lateral movement, yaw and tilt x {scale:g} (colour: tilt, white 0, red/blue +-{full:.1f} mrad)"
    machine = rrb.Tabs(space(case, DRAWN, drawn), space(case, TRUE, "True to scale"), active_tab=0)
    loads = rrb.Tabs(
        plot("series/moment", "Entry moment [N m]", travel),
        plot("series/tension", "Tension [N/mm2]", travel),
        plot("series/slip", "Lateral slip [um]", travel),
        plot("series/sag", "Sag [mm]", travel),
        plot("series/further", "Further", travel),
    )
    plots = rrb.Horizontal(
        plot("series/y", "Lateral position of points 1-4 [mm]", travel),
        plot("series/tilt", "Tilt at mid-span [mrad]", travel),
        loads,
        column_shares=[3, 2, 2],
    )
    body = rrb.Vertical(machine, plots, row_shares=[3, 2])
    return rrb.Blueprint(
        body, time_panel(), rrb.BlueprintPanel(state="collapsed"), rrb.SelectionPanel(state="collapsed")
    )
