"""A local web page for people who do not use terminals: simulate with sliders, compare and diagnose measurements.

NiceGUI (the extra ``app``) serves it on the loopback address only.
"""

from importlib.util import find_spec
from typing import Any

from belt_sim.errors import BeltError, flag, whole


def app_command(run_dir: Any) -> None:
    """Serve the page for people who do not use terminals until Ctrl-C; what it makes goes into the run folder."""
    port, show = run_dir.config["port"], flag("open", run_dir.config["open"])
    if port is not None:
        whole("port", port, 1, 65535, otherwise="null or ")
    if find_spec("nicegui") is None:
        raise BeltError("app: the page needs NiceGUI: pip install 'belt-sim[app]'")
    from belt_sim.app.server import serve

    serve(run_dir.path.resolve(), port, show=show)
