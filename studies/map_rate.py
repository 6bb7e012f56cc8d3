"""How many cases ``belt-sim map`` makes in a second, from one to a million: ``python -m studies.map_rate``.

Each map is made as the command makes it, its file and all, by a process that has compiled its march before. Time is
told both by the clock and as CPU time, which does not mind what else the machine does.
"""

import resource
import tempfile
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from belt_sim.api.sweep import sweep
from belt_sim.io import write_with
from studies.application import application


def measure(config: Mapping[str, Any], count: int) -> dict[str, Any]:
    """What a map of ``count`` cases costs: seconds, CPU seconds, MiB on disk, largest MiB of memory so far."""
    across = 10 ** ((len(str(count)) - 1) // 2)
    counts = {"tension": count // across, "yaw": across}
    axes = {k: {**config[k], "count": n} if n > 1 else [config[k]["to"]] for k, n in counts.items()}
    with tempfile.TemporaryDirectory() as scratch:
        began = time.perf_counter(), time.process_time()
        sweep(**{**config, **axes}).to_parquet(Path(scratch) / "map.parquet")
        seconds, cpu = time.perf_counter() - began[0], time.process_time() - began[1]
        disk = sum(p.stat().st_size for p in Path(scratch).rglob("*.parquet")) / 2**20
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    row = {"travel_m": config["travel"], "cases": count, "seconds": seconds, "cpu_seconds": cpu}
    return row | {"disk_mib": disk, "memory_mib": memory}


def map_rate(config: dict[str, Any]) -> None:
    """A row a number of cases, for closed forms and for marches; into ``table`` where it is named."""
    plain = {k: v for k, v in config.items() if k not in ("counts", "table")}
    plain["model"] = plain["model"]["name"]
    found = []
    for travel in (None, config["travel"]):
        asked = {**plain, "travel": travel}
        for count in config["counts"]:
            measure(asked, min(count, 1000))  # compiles for chunks of this size
            found.append(measure(asked, count))
            print({k: round(v, 3) if isinstance(v, float) else v for k, v in found[-1].items()}, flush=True)
    if config["table"]:
        table = pd.DataFrame(found)
        print(write_with(Path(config["table"]), lambda draft: table.to_csv(draft, index=False, float_format="%.4g")))


if __name__ == "__main__":
    application("map_rate", map_rate)
