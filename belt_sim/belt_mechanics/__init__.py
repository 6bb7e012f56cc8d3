"""The 3D belt as JAX arrays, which engine=mjx and engine=quasi_static share: mesh, landing, elastic force, block solve."""
