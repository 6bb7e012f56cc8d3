"""Constants of the 3D belt that its engines share: native, mjx and quasi_static."""

#: chords before the tangent point at which a station is caught; it is let go HYSTERESIS chords further out
CATCH_DISTANCE = 0.5
HYSTERESIS = 0.02
#: chords of travel over which a station forgets how far off its path it was caught
FORGETTING = 0.5
#: free stations over which the direction of a span is taken, and the time [s] over which it is averaged: waves pass
SPAN_STATIONS = 4
SPAN_TIME = 0.02
#: links beside a pulley over which moment, stress and direction are averaged; the last link, which turns, is left out
RUNUP_LINKS = 2
#: stations to either side of a wrap's end among which the belt passes the pulley's axis
AXIS_STATIONS = 4
#: of the bending layer: time [s] over which it is averaged, and the share of the mean stress that a fibre has at least
LAYER_TIME = 0.05
SLACKEST_FIBRE = 0.1
#: [s], of a pulley that gives way to the belt's moment
COMPLIANCE_TIME = 0.02
#: of a limp belt: stations over which its inclination is taken, and the largest distance [chords] of its kinks
KINK_STATIONS = 8
FURTHEST_KINK = 0.6
#: damping ratio of the tail pulley against the stretch of both spans; it acts on deviations from steady motion
TAIL_DAMPING_RATIO = 1.0
#: [1/s], drag of a belt at rest, about critical for the lowest sway of a span
REST_DRAG = 15.0
#: of a residual stress r (1 - 12 y^2/b^2), what it takes off the tension in the torsional stiffness, over r
RESIDUAL_TORSION = 0.8
#: belt widths: a belt that has run further sideways has left its pulleys
RUNAWAY = 3.0
