"""What the belt in three dimensions costs, beside an explicit integrator and a particle code, in one run."""
