"""The functions behind every front end: simulate, compare, diagnose, draw; free of the command line.

Loading this room (the first use of ``bs.simulate`` and the like does) sets up JAX's own cache of compiled programs on
disk, where the user has set up none.
"""

from belt_sim.jax_setup import keep_programs

keep_programs()
