"""Where a belt's nodes are and what ties them: the laid loop, rope, grid and membrane, their calibration, camber."""
