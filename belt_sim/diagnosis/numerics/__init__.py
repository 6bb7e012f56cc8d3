"""How steps are taken and tails are read: what a diagnosis computes with."""
