"""The file of a stream: one .npz with a schema version and the name of the model its poses belong to."""

from pathlib import Path
from typing import Any

from simprep.archive import open_archive, write_archive
from simprep.character import Character
from simprep.duel.stream.stream import DuelStream, player_name
from simprep.errors import MotionFileError
from simprep.humanoid_model import MODEL_NAME, MODEL_VERSION, humanoid
from simprep.motion.motion import Motion
from simprep.motion.store import read_poses

SCHEMA = "simprep.duel-stream/1"
KIND = "stream of people"
"""What messages call it."""
_HINTS = {"simprep.motion/": "one person; `simprep duel import A B` joins two"}


def save_stream(stream: DuelStream, path: str | Path) -> Path:
    """Write a stream to .npz, atomically, and return its path; `.npz` is appended if missing.

    Raises:
        MotionFileError: it cannot be written, or a player is not our humanoid, the only body that the file can name.
    """
    for player, motion in zip(stream.names, stream.players):
        if not _is_ours(motion.character):
            raise MotionFileError(
                path,
                f"player {player} is {motion.character}; fights are learned from and made for {MODEL_NAME} as it is",
            )
    header = {
        "schema": SCHEMA,
        "model": MODEL_NAME,
        "model_version": MODEL_VERSION,
        "hinges": stream.players[0].character.joints,
        "name": stream.name,
        "fps": stream.fps,
        "seams": stream.seams,
        "clips": stream.clips,
        "players": [
            {
                "name": motion.name,
                "source": motion.source,
                "events": dict(motion.events),
                "height_m": motion.character.height_m,
                "mass_kg": motion.character.mass_kg,
            }
            for motion in stream.players
        ],
    }
    named = list(zip(stream.names, stream.players))
    arrays: dict[str, Any] = {f"qpos_{player}": motion.qpos for player, motion in named}
    arrays |= {f"contacts_{player}": motion.contacts for player, motion in named}
    try:
        return write_archive(path, header, arrays)
    except OSError as error:
        raise MotionFileError(path, f"cannot be written ({error.strerror})") from None


def read_stream(path: str | Path) -> DuelStream:
    """Read a stream written by `save_stream`, from the .npz file or a folder with one.

    Raises:
        MotionFileError: missing, not a stream, another schema version or another model.
    """
    with open_archive(path, KIND, SCHEMA, _HINTS) as (header, archive):
        model = (header["model"], header["model_version"])
        if model != (MODEL_NAME, MODEL_VERSION) or tuple(header["hinges"]) != humanoid().joints:
            raise MotionFileError(
                path, f"poses of model {model[0]!r} version {model[1]!r}; valid: {MODEL_NAME!r} version {MODEL_VERSION}"
            )
        players = tuple(_player(header, archive, number) for number in range(len(header["players"])))
        return DuelStream(players, tuple(header["seams"]), tuple(header["clips"]), header["name"])


def _is_ours(character: Character) -> bool:
    """Whether stature and mass, which the file holds, say all about a character."""
    if character.name != MODEL_NAME or character.height_m is None or character.mass_kg is None:
        return False
    return character == humanoid(character.height_m, character.mass_kg)


def _player(header: dict[str, Any], archive: Any, number: int) -> Motion:
    about, name = header["players"][number], player_name(number)
    return Motion(
        qpos=read_poses(archive, f"qpos_{name}"),
        fps=header["fps"],
        contacts=archive[f"contacts_{name}"],
        events={str(key): int(value) for key, value in about["events"].items()},
        name=about["name"],
        source=about["source"],
        character=humanoid(about["height_m"], about["mass_kg"]),
    )
