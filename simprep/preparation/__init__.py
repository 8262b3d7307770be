"""Preparation (2013 paper): locomotion in the style of the action that comes next, and the launch of that action."""

from simprep.preparation.prepare import Preparation, prepare
from simprep.preparation.scenario import ALL_ARMS, ARMS, AlphaProfile, build_scenario, scenario
from simprep.preparation.settings import PreparationSettings

__all__ = [
    "ALL_ARMS",
    "ARMS",
    "AlphaProfile",
    "Preparation",
    "PreparationSettings",
    "build_scenario",
    "prepare",
    "scenario",
]
