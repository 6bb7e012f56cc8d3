"""Where on the upper span something stands, as a share of its length."""


class AtAPlace:
    """Mixed into a fault with a ``place``."""

    @classmethod
    def shape_by_lot(cls, plan, rng):
        return {"place": float(rng.uniform(0.1, 0.9))}

    @classmethod
    def shapes(cls, plan):
        return tuple({"place": place} for place in (0.15, 0.4, 0.6, 0.85))
