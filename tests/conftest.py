"""Every test sees the modules that stand beside this file (paper_cases)."""
