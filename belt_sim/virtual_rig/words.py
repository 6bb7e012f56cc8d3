"""The words in which a stranger is described, so that what is said of it can be scored."""

#: where an unknown acts
PLACES = (
    "yaw_tail",
    "yaw_head",
    "runup_tail",
    "runup_head",
    "runup_both",
    "wrap",
    "span",
    "tension",
    "travel",
    "sensor_all",
    "sensor_y1",
)
#: what it depends on
VARIABLES = (
    "travel",
    "time_since_step",
    "yaw",
    "curvature",
    "contact_angle",
    "y",
    "belt_phase",
    "pulley_phase",
    "wave",
    "speed",
    "tension",
)
#: how
FORMS = ("constant", "linear", "power", "saturating", "threshold", "exponential", "periodic", "random")
