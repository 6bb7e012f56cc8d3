"""Which effects are missing: evidence, its thresholds by chance, and the decision."""
