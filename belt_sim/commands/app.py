"""belt-sim app: a local web page for people who do not use terminals."""

from importlib.util import find_spec

from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import BeltError, flag, whole


def app(run_dir: RunDir) -> None:
    """Serve the page until Ctrl-C; what it makes goes into the run folder."""
    config = run_dir.config
    port, show = config["port"], flag("open", config["open"])
    if port is not None:
        whole("port", port, 1, 65535, otherwise="null or ")
    if find_spec("nicegui") is None:
        raise BeltError("app: the page needs NiceGUI: pip install 'belt-sim[app]'")
    from belt_sim.app.server import serve

    serve(run_dir.path.resolve(), port, show=show)
