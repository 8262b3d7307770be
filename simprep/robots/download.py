"""Models of robots known by name: the package `mujoco-menagerie` has them, and downloads each on first use."""

from pathlib import Path
from typing import Any

from simprep.errors import MissingExtraError, RobotFileError
from simprep.robots.description import RobotDescription


def downloaded_model(description: RobotDescription) -> Path:
    """The MJCF of a robot by the name that its description gives it in MuJoCo Menagerie.

    Args:
        description: of the robot.

    Raises:
        MissingExtraError: `mujoco-menagerie` is not installed.
        RobotFileError: it does not know the robot, or cannot download it.
    """
    try:
        import mujoco_menagerie
    except ImportError:
        raise MissingExtraError(
            f"the model of {description.name!r} by its name alone (its .xml is found without)", "robots"
        ) from None
    name, _, entry = description.menagerie.partition("/")
    try:
        robot: Any = mujoco_menagerie.get(name)
        return Path(robot.xml(entry or robot.default_model))
    except (mujoco_menagerie.MenagerieError, OSError) as error:
        raise RobotFileError(
            description.path,
            f"the model of {description.name!r} is not here and cannot be downloaded ({' '.join(str(error).split())[:200]}); "
            "valid: a connection once, MENAGERIE_ROOT as the folder of a copy of MuJoCo Menagerie, or the path of its .xml "
            "instead of its name",
        ) from None


def state_of_model(description: RobotDescription) -> str:
    """In words: whether the model of a robot is here; nothing is downloaded."""
    try:
        import mujoco_menagerie
    except ImportError:
        return "by path; by name with simprep[robots]"
    name = description.menagerie.partition("/")[0]
    if name not in mujoco_menagerie.names():
        return "by path; unknown to the installed mujoco-menagerie"
    robot, cache = mujoco_menagerie.get(name), mujoco_menagerie.Cache()
    here = cache.is_cached(robot) or (cache.root is not None and (cache.root / name).is_dir())
    size = f"{(robot.download_size or 0) / 1e6:.0f} MB, {robot.license}"
    return f"here ({robot.license})" if here else f"downloaded on first use ({size})"
