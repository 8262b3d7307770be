"""MOT and STO files of OpenSim: joint angles under OpenSim's header, in the axes of its models (x forward, y up, z right).

Joints that OpenSim's full-body model (Rajagopal et al. 2016, IEEE Trans Biomed Eng 63:2068) has as well are called by its
coordinates, with its signs; knees flex positively there. Our other joints are called `simprep_<joint>`. Of our two spine
joints its one, `lumbar_extension` and so on, is written too; it is read only where ours are missing.
"""

import warnings
from collections.abc import Mapping
from io import StringIO
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import MotionFileError
from simprep.humanoid_model import MODEL_NAME, humanoid
from simprep.motion.formats.angles import motion_of_angles, rate_of_times, sized_character, unusual_size
from simprep.motion.formats.bvh_write import lost
from simprep.motion.formats.format import Format, Glimpse, ReadMotion, ReadOptions
from simprep.motion.formats.numbers import number, numbers
from simprep.motion.formats.own_skeleton import known_characters
from simprep.motion.formats.segments import turns_of_poses
from simprep.motion.formats.skeleton import MAX_VALUES
from simprep.motion.formats.text import Comments, lines_of, open_text
from simprep.motion.formats.trc import OPENSIM_AXES
from simprep.motion.joint_map import shown_names
from simprep.motion.motion import Motion
from simprep.motion.rotations import continuous_quat

OWN = "simprep_"
"""Beginning of the columns that only simprep knows."""
COORDINATES = {
    f"{opensim}_{side[0]}": (f"{side}_{joint}", sign)
    for side in ("left", "right")
    for opensim, joint, sign in (
        ("hip_flexion", "hip_flexion", 1.0), ("hip_adduction", "hip_abduction", -1.0), ("hip_rotation", "hip_rotation", 1.0),
        ("knee_angle", "knee_flexion", 1.0), ("ankle_angle", "ankle_dorsiflexion", 1.0),
        ("subtalar_angle", "ankle_inversion", 1.0), ("arm_flex", "shoulder_flexion", 1.0),
        ("arm_add", "shoulder_abduction", -1.0), ("arm_rot", "shoulder_rotation", 1.0), ("elbow_flex", "elbow_flexion", 1.0),
    )
}  # fmt: skip
"""OpenSim's coordinates that are a joint of our humanoid: which, and the sign."""
PELVIS = ("pelvis_tilt", "pelvis_list", "pelvis_rotation", "pelvis_tx", "pelvis_ty", "pelvis_tz")
"""Turns about z, then x, then y, and the place [m]."""
LUMBAR = ("lumbar_extension", "lumbar_bending", "lumbar_rotation")
"""OpenSim's spine joint: turns about z, then x, then y."""
SPINE = ("lumbar", "thorax")


def write_opensim(motion: Motion, path: Path) -> tuple[str, ...]:
    """Write joint angles in degrees under OpenSim's header; returns what is lost."""
    character, qpos = motion.character, motion.qpos
    turn = Rotation.from_quat(qpos[:, 3:7], scalar_first=True).as_matrix()
    columns = {"time": motion.times}
    pelvis = np.concatenate([_angles(turn), qpos[:, :3] @ OPENSIM_AXES], axis=1)
    columns |= dict(zip(PELVIS, pelvis.T))
    named = {joint: (name, sign) for name, (joint, sign) in COORDINATES.items()} if _is_ours(character) else {}
    if named:
        spine = _spine(qpos, character)
        columns |= dict(zip(LUMBAR, _angles(spine[0] @ spine[1]).T))
    for index, joint in enumerate(character.joints):
        name, sign = named.get(joint, (OWN + joint, 1.0))
        columns[name] = np.degrees(sign * qpos[:, 7 + index])
    size = "".join(f"{key}={value:.9g}\n" for key, value in unusual_size(character).items())
    about = "Written by simprep: joint angles of a character; angles in degrees, places in metres."
    path.write_text(
        opensim_table("Coordinates", columns, f"{about}\ncharacter={character.name}\n{size}", degrees=True),
        encoding="utf-8",
        newline="\n",
    )
    return lost(motion)


def opensim_table(title: str, columns: Mapping[str, FloatArray], about: str, degrees: bool = False) -> str:
    """Columns (T,) by name as the text of a MOT or STO file; the first is `time`. NaN is written as `nan`.

    Args:
        title: first line of the header.
        columns: of equal length.
        about: further lines of the header, each ended.
        degrees: whether angles are in degrees, as the header says.
    """
    rows = len(next(iter(columns.values())))
    head = f"{title}\nversion=1\nnRows={rows}\nnColumns={len(columns)}\ninDegrees={'yes' if degrees else 'no'}\n\n{about}endheader\n"
    text = StringIO()
    np.savetxt(text, np.stack(list(columns.values()), axis=1), fmt="%.9f", delimiter="\t")
    return head + "\t".join(columns) + "\n" + text.getvalue()


def read_opensim(path: Path, options: ReadOptions) -> ReadMotion:
    """Read a file of coordinates, of simprep or of a model of OpenSim with Rajagopal's names.

    Raises:
        MotionFileError: malformed, with the line; neither degrees nor radians stated; no column that is a joint.
    """
    header, columns = _columns(path)
    stated = header.get("indegrees", "").lower()
    if stated not in ("yes", "no"):
        raise MotionFileError(path, f"inDegrees={stated[:20] or 'missing'}; valid: yes or no")
    factor = np.pi / 180 if stated == "yes" else 1.0
    notes = []
    given = header.get("character")
    character = next((one for one in known_characters(options.character) if one.name == given), None)
    if given is not None and character is None:
        raise MotionFileError(path, f"joint angles of {given[:40]!r}, which is not known here")
    if character is None:
        character = humanoid()
        notes.append(
            "OpenSim's coordinates taken as the humanoid's joint angles: its bones have other lengths than the model's, so "
            "the feet may float or sink; knee_angle must be positive in flexion (gait2392 has it negative)"
        )
    size = [number(path, header[key], key, None) if key in header else None for key in ("height_m", "mass_kg")]
    character = sized_character(path, character, *size)
    angles = {name.removeprefix(OWN): values * factor for name, values in columns.items() if name.startswith(OWN)}
    for name, (joint, sign) in COORDINATES.items() if _is_ours(character) else ():
        if name in columns:
            angles[joint] = sign * factor * columns[name]
    if (
        _is_ours(character)
        and not angles.keys() & {f"{part}_flexion" for part in SPINE}
        and set(LUMBAR) <= set(columns)
    ):
        for part in SPINE:  # half each
            for movement, name, sign in zip(("flexion", "bending", "rotation"), LUMBAR, (-1.0, -1.0, 1.0)):
                angles[f"{part}_{movement}"] = sign * factor * columns[name] / 2
    angles = {name: values for name, values in angles.items() if name in character.joints}
    if not angles:
        raise MotionFileError(
            path, f"no column is a joint angle; columns: {shown_names(tuple(columns), 8)}; known: {shown_names(tuple(COORDINATES), 30)}"
        )  # fmt: skip
    root = None
    if set(PELVIS) <= set(columns):
        tilt = np.stack([columns[name] for name in PELVIS[:3]], axis=1) * factor
        turn = OPENSIM_AXES @ Rotation.from_euler("ZXY", tilt).as_matrix() @ OPENSIM_AXES.T
        place = np.stack([columns[name] for name in PELVIS[3:]], axis=1) @ OPENSIM_AXES.T
        quat = Rotation.from_matrix(turn).as_quat(scalar_first=True)
        root = np.concatenate([place, continuous_quat(quat)], axis=1)
    fps = rate_of_times(path, columns.get("time"), options)
    return motion_of_angles(path, "OpenSim", fps, root, angles, character, notes)


def _is_ours(character: Character) -> bool:
    return character.name == MODEL_NAME


def _spine(qpos: FloatArray, character: Character) -> list[FloatArray]:
    """Turns (T, 3, 3) of our two spine joints."""
    turns = turns_of_poses(qpos, character)
    return [turns[:, character.segment(role)] for role in ("abdomen", "thorax")]


def _angles(turn: FloatArray) -> FloatArray:
    """Angles about OpenSim's z, x, y (T, 3) of turns (T, 3, 3) in our axes [deg]."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a body on its side: two angles for one turn, any of them is right
        return Rotation.from_matrix(OPENSIM_AXES.T @ turn @ OPENSIM_AXES).as_euler("ZXY", degrees=True)


def _columns(path: Path) -> tuple[dict[str, str], dict[str, FloatArray]]:
    """Keys of the header in lower case, and columns (T,) by name."""
    header: dict[str, str] = {}
    with open_text(path, "an OpenSim file (.mot, .sto)") as stream:
        lines = lines_of(path, stream)
        for _, text in lines:
            if text.strip().lower() == "endheader":
                break
            key, equals, value = text.partition("=")
            if equals:
                header[key.strip().lower()] = value.strip()
        line, names = 0, []
        for at, text in lines:
            line = at
            if names := text.split():
                break
        if not names:
            raise MotionFileError(path, "no 'endheader' and columns after it; valid: an OpenSim file", line or None)
        if len(set(names)) < len(names):
            raise MotionFileError(path, "two columns of one name", line)
        rest = stream.read()
    rows = sum(bool(text.strip()) for text in rest.split("\n"))
    if not rows:
        raise MotionFileError(path, "no frames", line)
    if rows * len(names) > MAX_VALUES:
        raise MotionFileError(path, f"{rows * len(names)} numbers; valid: up to {MAX_VALUES}")
    values, _, _ = numbers(path, rest, line + 1, len(names), rows, Comments())
    return header, dict(zip(names, values.T))


def _recognise(seen: Glimpse) -> str | None:
    lines = [line.strip().lower() for line in seen.text.splitlines()]
    if "endheader" not in lines:
        return None
    names = seen.text.splitlines()[lines.index("endheader") + 1 :]
    columns = next((line.split() for line in names if line.strip()), [])
    known = [name for name in columns if name in COORDINATES or name.startswith(OWN)]
    return f"OpenSim coordinates: {len(known)} known joints" if known else "OpenSim file without known joints"


FORMAT = Format("opensim", "OpenSim", (".mot", ".sto"), _recognise, read_opensim, write_opensim)
