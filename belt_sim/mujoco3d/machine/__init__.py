"""The two pulleys with their belt as a scene, and how they are turned, tensioned and driven."""
