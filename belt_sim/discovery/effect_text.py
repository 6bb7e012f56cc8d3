"""The text of a found effect's file, with places for its law."""

#: what a law may call: name -> its text
HELPERS = {
    "_commanded": '''def _commanded(case, travel):
    """The yaw as commanded [rad]."""
    return angle_at(case.settings.yaw, travel) + angle_at(case.settings.yaw_head, travel)


''',
    "_since": '''def _since(case, travel):
    """Travel since the yaw was set [m]."""
    return jnp.maximum(travel - case.settings.yaw.at[0], 0.0)


''',
    "_met": '''def _met(case, travel):
    """Which part of the belt runs up the tail and the head pulley, in belt lengths from the one that is at the tail
    pulley when a forward run starts."""
    span, wrap = case.rig.span_length, case.rig.wrap_tail
    ahead, back = travel - jnp.stack([0.0 * span, span + wrap]), jnp.stack([-wrap, span]) - travel
    return jnp.where(case.settings.direction > 0, ahead, back) / case.rig.belt_length


''',
    "_is_set": '''def _is_set(case, travel):
    """1 once the yaw is set."""
    return jnp.where(travel >= case.settings.yaw.at[0], 1.0, 0.0)


''',
    "_stop": '''def _stop(x, half, s):
    """What of a reading is held back by friction: it follows x along s, and slides beyond +-half."""
    order = jnp.argsort(s)
    along = x[order]

    def one(held, step):
        held = jnp.clip(held + step, -half, half)
        return held, held

    held = jax.lax.scan(one, 0.0 * along[0], jnp.diff(along, prepend=along[:1]))[1]
    return jnp.zeros_like(x).at[order].set(held)


''',
    "_rate": '''def _rate(reading, row, case, reach=0.25):
    """dy/dt of a reading [m/s]."""
    order = jnp.argsort(reading.seen)
    s, y = reading.seen[order], reading.y[row][order]
    low, high = (jnp.clip(reading.seen + h, s[0], s[-1]) for h in (-reach, reach))
    return (jnp.interp(high, s, y) - jnp.interp(low, s, y)) / (high - low) * case.settings.speed


''',
}

#: what the file imports, and the word by which it needs that
IMPORTS = {
    "import jax\n": "jax.",
    "import jax.numpy as jnp\n\n": "",
    "from belt_sim.effects.base import Effect, Parameter, effect\n": "",
    "from belt_sim.laws.drive import angle_at\n": "angle_at",
    "from belt_sim.laws.span import curvatures_by_change, log_of_change, response\n": "curvatures_by_change",
}

BEND = '''    def influence(self, span, case):
        """Return the curvature at the run-up per unit of the boundary values, and what each change adds."""
        return response(span).runup, [curvatures_by_change(span, case, kind) for kind in {kinds}]

    def bend(self, bend, boundary, known, case):
        shares = (
{shares}        )
        for share, added in zip(shares, known[1], strict=True):
            x = log_of_change(share) + jnp.zeros(2)
            more = jnp.einsum("ks,kai,is->as", x ** jnp.arange(1, 8)[:, None], added, boundary.ends)
            bend = replace(bend, runup=bend.runup + more[0], runoff=bend.runoff + more[1])
        return bend
'''

TEMPLATE = '''"""A law found in data, not yet understood: rename it once you know what it is."""

from dataclasses import dataclass, replace

{imports}

{helpers}@effect
@dataclass(frozen=True, kw_only=True)
class Found(Effect):
    """{said}"""

    id = "{id}"
    law = "{law}"
    reference = "discovered in data; see the docstring"
    parity = "{parity}"
    parameters = {{
{parameters}    }}
{fields}
{inputs}
{hooks}'''


def needed(body: str) -> dict[str, str]:
    """The imports and helpers of a file with this ``body``."""
    helpers = "".join(text for name, text in HELPERS.items() if f"{name}(" in body)
    return {
        "imports": "".join(line for line, word in IMPORTS.items() if word in helpers + body).rstrip(),
        "helpers": f"\n{helpers}",
    }
