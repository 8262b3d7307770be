"""simprep: physics-validated preparation motions and interactions for simulated humanoids.

The public API is re-exported here on purpose and loaded on first use, so that `import simprep` stays fast. Type checkers
and editors read the imports below.
"""

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from simprep.character import Character as Character
    from simprep.check.motion_check import MotionCheck as MotionCheck
    from simprep.check.motion_check import check_motion as check_motion
    from simprep.controller.policy import Policy as Policy
    from simprep.controller.policy import read_policy as read_policy
    from simprep.controller.policy import save_policy as save_policy
    from simprep.duel.analysis import analyse as analyse
    from simprep.duel.fight.default_model import fight_model as fight_model
    from simprep.duel.fight.fight import Fight as Fight
    from simprep.duel.fight.modes import begin_fight as begin_fight
    from simprep.duel.labels.segmentation import segment_stream as segment_stream
    from simprep.duel.model.store import read_model as read_model
    from simprep.duel.model.store import save_model as save_model
    from simprep.duel.stream.import_pair import import_pair as import_pair
    from simprep.duel.stream.store import read_stream as read_stream
    from simprep.duel.stream.store import save_stream as save_stream
    from simprep.duel.stream.stream import DuelStream as DuelStream
    from simprep.errors import MissingExtraError as MissingExtraError
    from simprep.errors import MotionError as MotionError
    from simprep.errors import MotionFileError as MotionFileError
    from simprep.errors import SettingError as SettingError
    from simprep.errors import SimprepError as SimprepError
    from simprep.errors import UnknownNameError as UnknownNameError
    from simprep.humanoid_model import humanoid as humanoid
    from simprep.library.registry import library_motion as library_motion
    from simprep.library.registry import library_names as library_names
    from simprep.metrics.evaluate import evaluate_motion as evaluate_motion
    from simprep.metrics.evaluate import evaluate_run as evaluate_run
    from simprep.metrics.metric import Metric as Metric
    from simprep.metrics.metric import Metrics as Metrics
    from simprep.metrics.metric import metrics_table as metrics_table
    from simprep.motion.export import export_motion as export_motion
    from simprep.motion.load import ImportReport as ImportReport
    from simprep.motion.load import ImportResult as ImportResult
    from simprep.motion.load import import_motion as import_motion
    from simprep.motion.load import load_motion as load_motion
    from simprep.motion.motion import Motion as Motion
    from simprep.motion.store import read_motion as read_motion
    from simprep.motion.store import save_motion as save_motion
    from simprep.physics.controller import Controller as Controller
    from simprep.physics.controller import ControlTask as ControlTask
    from simprep.physics.mismatch import Mismatch as Mismatch
    from simprep.physics.mpc_settings import MPC_PRESETS as MPC_PRESETS
    from simprep.physics.mpc_settings import MpcSettings as MpcSettings
    from simprep.physics.pushes import Kick as Kick
    from simprep.physics.pushes import Push as Push
    from simprep.physics.pushes import random_kicks as random_kicks
    from simprep.physics.run import Run as Run
    from simprep.physics.settings import SimulationSettings as SimulationSettings
    from simprep.physics.simulate import simulate as simulate
    from simprep.physics.simulate import track as track
    from simprep.physics.store import read_run as read_run
    from simprep.physics.store import save_run as save_run
    from simprep.physics.tracker import Tracker as Tracker
    from simprep.physics.tracker_state import TrackerState as TrackerState
    from simprep.preparation.prepare import prepare as prepare
    from simprep.preparation.scenario import scenario as scenario
    from simprep.preparation.settings import PreparationSettings as PreparationSettings
    from simprep.robots.load import load_robot as load_robot
    from simprep.scene import SceneSettings as SceneSettings

_EXPORTS = {
    "Character": "simprep.character",
    "ControlTask": "simprep.physics.controller",
    "Controller": "simprep.physics.controller",
    "DuelStream": "simprep.duel.stream.stream",
    "Fight": "simprep.duel.fight.fight",
    "ImportReport": "simprep.motion.load",
    "ImportResult": "simprep.motion.load",
    "Metric": "simprep.metrics.metric",
    "Metrics": "simprep.metrics.metric",
    "MissingExtraError": "simprep.errors",
    "Motion": "simprep.motion.motion",
    "MotionCheck": "simprep.check.motion_check",
    "MotionError": "simprep.errors",
    "MotionFileError": "simprep.errors",
    "Kick": "simprep.physics.pushes",
    "Mismatch": "simprep.physics.mismatch",
    "MPC_PRESETS": "simprep.physics.mpc_settings",
    "MpcSettings": "simprep.physics.mpc_settings",
    "Policy": "simprep.controller.policy",
    "PreparationSettings": "simprep.preparation.settings",
    "Push": "simprep.physics.pushes",
    "Run": "simprep.physics.run",
    "SceneSettings": "simprep.scene",
    "SettingError": "simprep.errors",
    "SimprepError": "simprep.errors",
    "SimulationSettings": "simprep.physics.settings",
    "Tracker": "simprep.physics.tracker",
    "TrackerState": "simprep.physics.tracker_state",
    "UnknownNameError": "simprep.errors",
    "analyse": "simprep.duel.analysis",
    "begin_fight": "simprep.duel.fight.modes",
    "check_motion": "simprep.check.motion_check",
    "evaluate_motion": "simprep.metrics.evaluate",
    "evaluate_run": "simprep.metrics.evaluate",
    "export_motion": "simprep.motion.export",
    "fight_model": "simprep.duel.fight.default_model",
    "humanoid": "simprep.humanoid_model",
    "import_motion": "simprep.motion.load",
    "import_pair": "simprep.duel.stream.import_pair",
    "library_motion": "simprep.library.registry",
    "library_names": "simprep.library.registry",
    "load_motion": "simprep.motion.load",
    "load_robot": "simprep.robots.load",
    "metrics_table": "simprep.metrics.metric",
    "prepare": "simprep.preparation.prepare",
    "random_kicks": "simprep.physics.pushes",
    "read_model": "simprep.duel.model.store",
    "read_motion": "simprep.motion.store",
    "read_policy": "simprep.controller.policy",
    "read_run": "simprep.physics.store",
    "read_stream": "simprep.duel.stream.store",
    "save_model": "simprep.duel.model.store",
    "save_motion": "simprep.motion.store",
    "save_policy": "simprep.controller.policy",
    "save_run": "simprep.physics.store",
    "save_stream": "simprep.duel.stream.store",
    "scenario": "simprep.preparation.scenario",
    "segment_stream": "simprep.duel.labels.segmentation",
    "simulate": "simprep.physics.simulate",
    "track": "simprep.physics.simulate",
}

__all__ = ["__version__", *_EXPORTS]


def __getattr__(name: str) -> Any:
    if name in _EXPORTS:
        return getattr(importlib.import_module(_EXPORTS[name]), name)
    raise AttributeError(f"module 'simprep' has no attribute {name!r}; valid: {', '.join(__all__)}")


def __dir__() -> list[str]:
    return sorted(__all__)
