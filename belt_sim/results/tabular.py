"""Results as tables of pandas and labelled arrays of xarray."""

from collections.abc import Mapping
from typing import Any

from belt_sim.errors import BeltError


def frame(rows: Any) -> Any:
    """A pandas DataFrame from columns or rows."""
    import pandas as pd

    return pd.DataFrame(rows)


def dataset(variables: Mapping[str, Any], coords: Mapping[str, Any], units: Mapping[str, str]) -> Any:
    """An xarray Dataset whose variables carry their units; raises BeltError when xarray is not installed."""
    try:
        import xarray as xr
    except ImportError as missing:
        raise BeltError("to_xarray: xarray is not installed; run `pip install 'belt-sim[xarray]'`") from missing
    made = xr.Dataset(dict(variables), dict(coords))
    for name, unit in units.items():
        made[name].attrs["units"] = unit
    return made
