"""Models of robots known by name: `robot_descriptions` finds them, and downloads them on first use."""

import importlib
from pathlib import Path

from simprep.errors import MissingExtraError, RobotFileError
from simprep.robots.description import RobotDescription


def downloaded_model(description: RobotDescription) -> Path:
    """The MJCF of a robot by the module of `robot_descriptions` that its description names.

    Args:
        description: of the robot.

    Raises:
        MissingExtraError: `robot_descriptions` is not installed.
        RobotFileError: it does not know the robot, or cannot download it.
    """
    try:
        importlib.import_module("robot_descriptions")
    except ImportError:
        raise MissingExtraError(f"the model of robot {description.name!r} by its name", "robots") from None
    try:
        return Path(importlib.import_module(f"robot_descriptions.{description.package}").MJCF_PATH)
    except Exception as error:  # whatever git and the network raise
        raise RobotFileError(
            description.path,
            f"the model of {description.name!r} cannot be downloaded ({' '.join(str(error).split())[:200]}); valid: the path "
            "of its .xml instead of its name",
        ) from None
