"""The two pulleys: how they are turned, tensioned and driven."""
