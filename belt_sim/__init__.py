"""belt_sim: the lateral movement of steel belts, modelled, measured and compared."""
