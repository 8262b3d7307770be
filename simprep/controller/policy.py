"""A trained controller: which core node and which level of preparation come next, in every state."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simprep.archive import open_archive, write_archive
from simprep.controller.displacement import DisplacementTable
from simprep.controller.settings import ControllerSettings, RewardSettings
from simprep.controller.spaces import ACTIONS, ALPHA_LEVELS, ALPHA_STEP, Action, Observation, encode
from simprep.controller.value_iteration import STATE_SHAPE
from simprep.display import SelfShowing
from simprep.errors import MotionFileError
from simprep.preparation.settings import PreparationSettings

SCHEMA = "simprep.policy/1"


@dataclass(frozen=True)
class Policy(SelfShowing):
    """The greedy policy of a trained controller, with what it was trained for.

    Attributes:
        actions: (6, 4, 40, 20) by alpha level, core node, goal cell and influence cell: core node * 6 + alpha level.
        table: the displacements it was trained with.
        settings: core nodes, action duration, rewards, preparation.
        origin: how it was found (`method`, `steps`, `seed`, ...).
    """

    actions: NDArray[np.uint8]
    table: DisplacementTable
    settings: ControllerSettings
    origin: Mapping[str, Any]

    def act(self, observation: Observation) -> Action:
        """The action in a state; `alpha` is the unfiltered level commanded last, 1 once the influence was reached."""
        choice = int(self.actions[encode(observation)])
        return Action(choice // ALPHA_LEVELS, choice % ALPHA_LEVELS * ALPHA_STEP)

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(policy)` and Jupyter show."""
        return "policy", {
            "core nodes": ", ".join(self.settings.cores),
            "levels of preparation": ALPHA_LEVELS,
            "states": self.actions.size,
            "an action [s]": round(self.action_frames / self.table.fps, 3),
            **{f"found by: {name}": value for name, value in self.origin.items()},
        }

    @property
    def action_frames(self) -> int:
        """Frames per action, at the frame rate of the displacements."""
        return self.table.frames


def save_policy(policy: Policy, path: str | Path) -> Path:
    """Write a policy to .npz, atomically; `.npz` is appended to the path if missing."""
    header = {
        "schema": SCHEMA,
        "fps": policy.table.fps,
        "settings": settings_to_json(policy.settings),
        "origin": dict(policy.origin),
    }
    return write_archive(path, header, {"actions": policy.actions, "displacement": policy.table.path})


def read_policy(path: str | Path) -> Policy:
    """Read a policy written by `save_policy`, from the .npz file or a folder with one.

    Raises:
        MotionFileError: missing, not a policy, or of another schema version.
    """
    with open_archive(path, "policy", SCHEMA) as (header, archive):
        actions, displacement = archive["actions"], archive["displacement"]
        if actions.shape != STATE_SHAPE or actions.max() >= ACTIONS:
            raise MotionFileError(path, f"actions of shape {actions.shape}; valid: {STATE_SHAPE}, below {ACTIONS}")
        settings = settings_from_json(header["settings"])
        return Policy(actions, DisplacementTable(displacement, float(header["fps"])), settings, header["origin"])


def settings_to_json(settings: ControllerSettings) -> dict[str, Any]:
    """The settings in JSON's types."""
    content = asdict(settings)
    return {**content, "cores": list(settings.cores), "barred": [list(pair) for pair in settings.barred]}


def settings_from_json(content: Mapping[str, Any]) -> ControllerSettings:
    """Inverse of `settings_to_json`.

    Raises TypeError for an unknown setting, KeyError for a missing one, SettingError for a value outside its range.
    """
    nested = {
        "cores": tuple(content["cores"]),
        "barred": tuple((first, second) for first, second in content["barred"]),
        "rewards": RewardSettings(**content["rewards"]),
        "preparation": PreparationSettings(**content["preparation"]),
    }
    return ControllerSettings(**{**content, **nested})
