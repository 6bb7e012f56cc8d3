"""What acts in a batch beyond sticking: decided once, so that a batch that needs none of it computes none of it."""

import math
from collections.abc import Sequence
from typing import NamedTuple

from belt_sim.scene_parts import SceneParts


class Acting(NamedTuple):
    """In some case of a batch: slips, it may slide on its pulleys; guides, number of rollers; gives_way, a pulley does
    so to the belt's moment; layered, it leaves its pulleys along a bending layer; cambered, it is curved by nature;
    pushes, number of places at which its spans are pushed; leans, its weight or a couple all along pulls it aside;
    canted, an axis is not level."""

    slips: bool = False
    guides: int = 0
    gives_way: bool = False
    layered: bool = False
    cambered: bool = False
    pushes: int = 0
    leans: bool = False
    canted: bool = False


def acting_in(parts: Sequence[SceneParts]) -> Acting:
    """What acts in any of these scenes."""
    return Acting(
        slips=any(math.isfinite(p.friction) for p in parts),
        guides=max(len(p.edge_guides) for p in parts),
        gives_way=any(s.yaw_compliance for p in parts for s in (p.head, p.tail)),
        layered=any(p.lift_off for p in parts),
        cambered=any(p.camber is not None for p in parts),
        pushes=max(len(p.pushes) for p in parts),
        leans=any(p.lean or p.roll for p in parts),
        canted=any(s.cant for p in parts for s in (p.head, p.tail)),
    )
