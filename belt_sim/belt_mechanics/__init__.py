"""The 3D belt as JAX arrays, shared by engine=mjx and quasi_static: mesh, landing, elastic force, block solve."""
