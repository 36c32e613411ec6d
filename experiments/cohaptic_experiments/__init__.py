"""Experiments on the real server and client code; the only package that may import both sides.

A public name is imported from its module when it is first used.
"""

from typing import TYPE_CHECKING

from cohaptic.compiled import use
from cohaptic.lazy import lazy_names

use("kernels")  # before the client's modules import one of them

if TYPE_CHECKING:
    from cohaptic_experiments.catalogue import EXPERIMENTS as EXPERIMENTS
    from cohaptic_experiments.catalogue import Experiment as Experiment
    from cohaptic_experiments.catalogue import load as load
    from cohaptic_experiments.outcome import Options as Options
    from cohaptic_experiments.outcome import Outcome as Outcome
    from cohaptic_experiments.transparency.scheme import Scheme as Scheme
    from cohaptic_experiments.virtual_session import VirtualSession as VirtualSession
    from cohaptic_experiments.virtual_session import VirtualUser as VirtualUser

__all__ = [
    "EXPERIMENTS",
    "Experiment",
    "Options",
    "Outcome",
    "Scheme",
    "VirtualSession",
    "VirtualUser",
    "load",
]

# The module that defines each public name.
_HOMES = {
    "Scheme": "cohaptic_experiments.transparency.scheme",
    "EXPERIMENTS": "cohaptic_experiments.catalogue",
    "Experiment": "cohaptic_experiments.catalogue",
    "load": "cohaptic_experiments.catalogue",
    "Options": "cohaptic_experiments.outcome",
    "Outcome": "cohaptic_experiments.outcome",
    "VirtualSession": "cohaptic_experiments.virtual_session",
    "VirtualUser": "cohaptic_experiments.virtual_session",
}

if not TYPE_CHECKING:  # otherwise a type checker would accept any name
    __getattr__, __dir__ = lazy_names(globals(), _HOMES)
