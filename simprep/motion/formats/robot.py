"""The formats of robots' motions, as the registry lists them. All hold joint angles: nothing is retargeted."""

from collections.abc import Callable
from pathlib import Path

from simprep.motion.formats.format import Format, Glimpse, ReadMotion, ReadOptions
from simprep.motion.formats.robot_arrays import read_robot_npz, read_robot_pickle, robot_arrays_kind
from simprep.motion.formats.robot_motion import robot_motion
from simprep.motion.formats.robot_write import write_beyondmimic, write_gmr, write_holosoma, write_mjlab
from simprep.motion.formats.unitree_csv import is_headless_csv, read_unitree_csv, write_unitree_csv

_PICKLE_SUFFIXES = (".pkl", ".pickle", ".joblib")
_PICKLE_HEADS = tuple(bytes([0x80, protocol]) for protocol in range(2, 6))


def _is_csv(seen: Glimpse) -> str | None:
    if is_headless_csv(seen.text):
        return "robot CSV without header: root, quaternion xyzw, joint angles"
    return None


def _read_csv(path: Path, options: ReadOptions) -> ReadMotion:
    return robot_motion(read_unitree_csv(path), options)


def _with_keys_of(kind: str) -> Callable[[Glimpse], str | None]:
    def recognise(seen: Glimpse) -> str | None:
        return f"robot motion of {kind} (.npz)" if robot_arrays_kind(set(seen.entries)) == kind else None

    return recognise


def _read_npz(path: Path, options: ReadOptions) -> ReadMotion:
    return robot_motion(read_robot_npz(path), options)


def _is_pickle(seen: Glimpse) -> str | None:
    if seen.suffix in _PICKLE_SUFFIXES or (seen.raw.startswith(_PICKLE_HEADS) and not seen.suffix):
        return "pickle of a robot's motion (GMR, ASAP or PBHC)"
    return None


def _read_pickle(path: Path, options: ReadOptions) -> ReadMotion:
    return robot_motion(read_robot_pickle(path, options.clip), options)


FORMATS: tuple[Format, ...] = (
    Format("unitree", "robot CSV without header (Unitree)", (".csv",), _is_csv, _read_csv, write_unitree_csv),
    Format(
        "beyondmimic", "BeyondMimic", (".npz",), _with_keys_of("BeyondMimic, mjlab or holosoma"), _read_npz,
        write_beyondmimic,
    ),
    Format("mjlab", "mjlab", (".npz",), lambda seen: None, None, write_mjlab),
    Format("gmr", "GMR without pickle", (".npz",), _with_keys_of("GMR"), _read_npz, write_gmr),
    Format("asap", "ASAP or PBHC without pickle", (".npz",), _with_keys_of("ASAP or PBHC"), _read_npz),
    Format(
        "holosoma", "holosoma or OmniRetarget", (".npz",), _with_keys_of("holosoma or OmniRetarget"), _read_npz,
        write_holosoma,
    ),
    Format("pickle", "GMR, ASAP or PBHC", _PICKLE_SUFFIXES, _is_pickle, _read_pickle),
)  # fmt: skip
"""`mjlab` is read as `beyondmimic`: only the order of bodies tells them apart, which the reader finds."""
