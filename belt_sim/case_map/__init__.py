"""Maps of many analytic cases: what varies, where the cases lie, what is told of each, how it reaches the disk."""
