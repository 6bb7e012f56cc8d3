"""What ``import belt_sim as bs`` offers, for editors and type checkers, and by ``__init__.py`` for Python itself."""

from belt_sim import mjx as mjx
from belt_sim.api.campaigns import import_files as import_files
from belt_sim.api.check import check as check
from belt_sim.api.check import check_effect as check_effect
from belt_sim.api.compare import compare as compare
from belt_sim.api.inference import diagnose as diagnose
from belt_sim.api.inference import discover as discover
from belt_sim.api.inference import fit as fit
from belt_sim.api.plot import plot as plot
from belt_sim.api.plot import report as report
from belt_sim.api.simulate import export as export
from belt_sim.api.simulate import jax_function as jax_function
from belt_sim.api.simulate import linearise as linearise
from belt_sim.api.simulate import model_named as model_named
from belt_sim.api.simulate import models as models
from belt_sim.api.simulate import scene as scene
from belt_sim.api.simulate import simulate as simulate
from belt_sim.api.sweep import sweep as sweep
from belt_sim.campaign import Campaign as Campaign
from belt_sim.campaign import read_campaign
from belt_sim.case import Belt as Belt
from belt_sim.case import Case as Case
from belt_sim.case import Rig as Rig
from belt_sim.case import Schedule as Schedule
from belt_sim.case import Settings as Settings
from belt_sim.curves import Curves as Curves
from belt_sim.effects.base import Effect as Effect
from belt_sim.effects.base import library as library
from belt_sim.errors import BeltError as BeltError
from belt_sim.errors import InputError as InputError
from belt_sim.jax_setup import prepare as prepare
from belt_sim.linear.loop import close_loop as close_loop
from belt_sim.results.diagnosis import Diagnosis as Diagnosis
from belt_sim.results.diagnosis import Discovery as Discovery
from belt_sim.results.diagnosis import Verdict as Verdict
from belt_sim.results.errors import Check as Check
from belt_sim.results.errors import Comparison as Comparison
from belt_sim.results.files import read_diagnosis
from belt_sim.results.simulation import Simulation as Simulation
from belt_sim.settings import make_case as make_case

load_campaign = read_campaign
load_diagnosis = read_diagnosis
__version__: str
