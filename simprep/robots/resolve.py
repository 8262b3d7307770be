"""From what a person types to the files of a robot: its MJCF and its TOML description."""

from dataclasses import dataclass
from pathlib import Path

from simprep.errors import RobotFileError, UnknownNameError
from simprep.humanoid_model import mjcf_folder
from simprep.robots.description import RobotDescription, matches, read_description
from simprep.robots.model import hinge_names
from simprep.robots.source import read_robot_model

MODEL_SUFFIXES = (".xml", ".mjcf")


@dataclass(frozen=True)
class RobotFiles:
    """Files of a robot: its model and its description."""

    mjcf: Path
    toml: Path


def shipped_robots() -> dict[str, Path]:
    """TOML descriptions that simprep has, by the robot's name."""
    return {path.stem: path for path in sorted((mjcf_folder() / "robots").glob("*.toml"))}


def find_robot(name_or_path: str | Path) -> RobotFiles:
    """The files of a robot; arguments and errors as for `simprep.robots.load.load_robot`."""
    text = str(name_or_path)
    path = Path(text)
    if path.suffix.lower() == ".toml":
        description = read_description(path)
        return RobotFiles(_model_of(description), path)
    if path.suffix.lower() in MODEL_SUFFIXES or len(path.parts) > 1:
        return RobotFiles(path, _description_of(path))
    shipped = shipped_robots()
    if text not in shipped:
        choices = (*shipped, "or the path of a robot's .xml or .toml")
        raise UnknownNameError("robot", text, choices)
    return RobotFiles(_model_of(read_description(shipped[text])), shipped[text])


def _model_of(description: RobotDescription) -> Path:
    if description.model:
        return (description.path.parent / description.model).resolve()
    if description.menagerie:
        from simprep.robots.download import downloaded_model

        return downloaded_model(description)
    raise RobotFileError(description.path, 'names no model; valid: model = "path of the .xml" or menagerie')


def _description_of(mjcf: Path) -> Path:
    """The TOML beside a model, or the shipped one whose joints are the model's."""
    beside = mjcf.with_suffix(".toml")
    if beside.is_file():
        return beside
    _, model = read_robot_model(mjcf)
    hinges = hinge_names(model)
    for path in shipped_robots().values():
        known = read_description(path)
        free = {name for name in hinges if not matches(name, known.locked)}
        if free == set(known.movements.values()):
            return path
    raise RobotFileError(
        mjcf,
        f"no {beside.name} beside it, and its joints are those of no shipped robot ({', '.join(shipped_robots())}); "
        f"'simprep robot describe {mjcf.name} -o {beside.name}' writes a first one",
    )
