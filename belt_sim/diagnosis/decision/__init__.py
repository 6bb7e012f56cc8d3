"""The decision: one table of evidence, one policy, one pure function."""
