"""Maps of many analytic cases: what varies, where the cases lie, how they reach the disk."""
