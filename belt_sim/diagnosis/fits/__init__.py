"""Sets of effects fitted to a campaign: one, many at once, on a grid, within what is plausible, with runs left out."""
