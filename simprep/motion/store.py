"""simprep's own motion file: one .npz with a schema version and the identity of the model its poses belong to."""

from pathlib import Path

from simprep.archive import open_archive, write_archive
from simprep.errors import MotionFileError
from simprep.humanoid import HINGES, MODEL_NAME, MODEL_VERSION, Body
from simprep.motion.motion import Motion

SCHEMA = "simprep.motion/1"


def save_motion(motion: Motion, path: str | Path) -> Path:
    """Write a motion to .npz, atomically (a temporary file, then a rename).

    Args:
        motion: what to write.
        path: the file; `.npz` is appended if missing.

    Returns:
        The path written.
    """
    header = {
        "schema": SCHEMA,
        "model": MODEL_NAME,
        "model_version": MODEL_VERSION,
        "hinges": HINGES,
        "fps": motion.fps,
        "events": dict(motion.events),
        "name": motion.name,
        "source": motion.source,
        "loop": motion.loop,
        "height_m": motion.body.height_m,
        "mass_kg": motion.body.mass_kg,
    }
    return write_archive(path, header, {"qpos": motion.qpos, "contacts": motion.contacts})


def read_motion(path: str | Path) -> Motion:
    """Read a motion written by `save_motion`.

    Args:
        path: the .npz file.

    Raises:
        MotionFileError: missing, not ours, another schema version or another model.
    """
    with open_archive(path, "simprep motion", SCHEMA) as (header, archive):
        model = (header.get("model"), header.get("model_version"))
        if model != (MODEL_NAME, MODEL_VERSION) or tuple(header.get("hinges", ())) != HINGES:
            raise MotionFileError(
                path,
                f"poses of model {model[0]!r} version {model[1]!r}; valid: {MODEL_NAME!r} version {MODEL_VERSION}",
            )
        return Motion(
            qpos=archive["qpos"],
            fps=header["fps"],
            contacts=archive["contacts"],
            events={str(key): int(value) for key, value in header["events"].items()},
            name=header["name"],
            source=header["source"],
            loop=bool(header["loop"]),
            body=Body(header["height_m"], header["mass_kg"]),
        )
