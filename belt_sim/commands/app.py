"""belt-sim app: a local web page for people who do not use terminals."""

from importlib.util import find_spec

from belt_sim.commands.run_dir import RunDir
from belt_sim.errors import BeltError, InputError


def run(run_dir: RunDir) -> None:
    """Serve the page until Ctrl-C; what it makes goes into the run folder."""
    config = run_dir.config
    port, show = config["port"], config["open"]
    if port is not None and (isinstance(port, bool) or not isinstance(port, int) or not 0 < port < 65536):
        raise InputError("port", port, "", "give a whole number from 1 to 65535, or null for any that is free")
    if not isinstance(show, bool):
        raise InputError("open", show, "", "give true or false")
    if find_spec("nicegui") is None:
        raise BeltError("app: the page needs NiceGUI: pip install 'belt-sim[app]'")
    from belt_sim.app.server import serve

    serve(run_dir.path.resolve(), port, show=show)
