"""One case, from its definition to its numbers. The same bits in any process, on any machine of one kind."""

import hashlib
import platform
import traceback
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from time import perf_counter, process_time
from typing import Any

import numpy as np

from simprep.character import Character
from simprep.characters import character_of_name
from simprep.errors import MotionError, MotionFileError, SettingError, SimprepError
from simprep.library import library_motion
from simprep.metrics.evaluate import evaluate_motion, evaluate_run
from simprep.motion.edit import to_length, yaw
from simprep.motion.formats.acclaim import find_skeleton
from simprep.motion.motion import Motion
from simprep.motion.transfer import import_onto, onto
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.pushes import Push
from simprep.physics.run import Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.simulate import track
from simprep.preparation import scenario
from simprep.preparation.scenario import AlphaProfile
from simprep.study.plan import BEFORE_PHYSICS
from simprep.study.sweep.cases import LAUNCH, Body, Clip, SweepCase
from simprep.threads import one_thread

MEASURED, BAD_INPUT, ERROR = "measured", "bad_input", "error"
"""How a case ends besides `done`, `fell` and `diverged`: a motion that was not simulated; a file or combination that cannot
be used; anything else that went wrong."""
LOOP_S = 6.0
"""Length of a loop, unless another is asked for [s]."""


def measure_case(case: SweepCase, threads: int = 1) -> dict[str, Any]:
    """Run a case, whatever comes of it.

    Returns:
        `end` (`done`, `fell`, `diverged`, `measured`, `bad_input` or `error`), `reason` in words, `metrics` by name, and
        `cost`: `wall_s`, `cpu_s` and the kind of processor, which differ from time to time.

    Args:
        case: what to run.
        threads: simulation threads of `mpc`; 0 for all cores. Does not change the result.
    """
    wall, cpu = perf_counter(), process_time()
    try:
        end, reason, metrics = _measure(case, threads)
    except SimprepError as error:
        end, reason, metrics = BAD_INPUT, " ".join(str(error).split()), {}
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        end, metrics = ERROR, {}
        reason = f"{type(error).__name__}: {' '.join(str(error).split())} ({Path(place.filename).name}:{place.lineno})"
    cost = {
        "wall_s": round(perf_counter() - wall, 4),
        "cpu_s": round(process_time() - cpu, 4),
        "processor": processor(),
    }
    return {"end": end, "reason": reason[:1000], "metrics": metrics, "cost": cost}


@one_thread
def _measure(case: SweepCase, threads: int) -> tuple[str, str, dict[str, Any]]:
    made = case_result(case, threads)
    if isinstance(made, Motion):
        return MEASURED, "not simulated", dict(evaluate_motion(made))
    metrics = dict(evaluate_run(made))
    del metrics["end"], metrics["s_per_s"]  # the first is said outside, the second is not a property of the case
    return made.end, made.end_reason, metrics


@one_thread
def case_result(case: SweepCase, threads: int = 1) -> Run | Motion:
    """What a case simulates, or the motion of one that is measured before physics; the same bits every time.

    Args:
        case: what to run.
        threads: as of `measure_case`.

    Raises:
        SimprepError: a file or combination that cannot be used.
    """
    motion = _motion(case)
    if case.controller == BEFORE_PHYSICS:
        return motion
    return track(motion, case.controller, case.seed, _settings(case, motion, threads))


def _motion(case: SweepCase) -> Motion:
    """What is tracked."""
    if case.clip:
        motion = clip_motion(case.clip, case.body)
        return to_length(motion, (LOOP_S if motion.loop else motion.duration) if case.seconds is None else case.seconds)
    assert case.locomotion
    assert case.target
    assert case.arm
    profile = replace(case.profile, level=case.alpha or 0.0)
    return _scenario(case.locomotion, case.target, case.body, profile, case.arm)


@lru_cache(maxsize=256)
def _scenario(locomotion: Clip, target: Clip, body: Body, profile: AlphaProfile, arm: str) -> Motion:
    return scenario(clip_motion(locomotion, body), clip_motion(target, body), profile, arm)


@lru_cache(maxsize=64)
def clip_motion(clip: Clip, body: Body) -> Motion:
    """The motion that a clip is on a body.

    Raises:
        SimprepError: it cannot be read or retargeted, or has changed since the sweep was made.
    """
    character = body_character(body)
    if body.digest and character.digest != body.digest:
        raise MotionError(
            f"character {body.name} has changed since the sweep was made: {character.digest}, {body.digest}"
        )
    if not clip.path:
        motion = onto(library_motion(clip.name), character)
    else:
        if clip_digest(Path(clip.path)) != clip.sha256:
            raise MotionFileError(clip.path, "has changed since the sweep was made")
        motion = import_onto(clip.path, character).motion
        motion = replace(motion, name=Path(clip.name).stem)
    if clip.target_frame is not None:
        motion = replace(motion, events={**motion.events, "target": clip.target_frame})
    return motion


@lru_cache(maxsize=64)
def body_character(body: Body) -> Character:
    """The character of a body.

    Raises:
        SimprepError: there is none.
    """
    return character_of_name(body.name, body.height_m, body.mass_kg)


def clip_digest(path: Path) -> str:
    """SHA-256 of a motion file, and of the skeleton that belongs to an .amc.

    Raises:
        MotionFileError: a file cannot be read.
    """
    digest = hashlib.sha256()
    try:
        for part in (path, *((find_skeleton(path),) if path.suffix.lower() == ".amc" else ())):
            with part.open("rb") as stream:
                digest.update(hashlib.file_digest(stream, "sha256").digest())
    except OSError as error:
        raise MotionFileError(path, f"cannot be read ({error.strerror})") from None
    return digest.hexdigest()


def _settings(case: SweepCase, motion: Motion, threads: int) -> SimulationSettings:
    disturbance = case.disturbance
    mpc = MPC_PRESETS[case.preset or "default"]
    pushes: tuple[Push, ...] = ()
    if disturbance.push_n_per_kg:
        at = disturbance.push_at
        if at == LAUNCH:
            at = motion.events[LAUNCH] / motion.fps if LAUNCH in motion.events else motion.duration / 2
        if not float(at) + disturbance.push_s < motion.duration:
            raise SettingError(
                f"disturbance {disturbance.name!r}: push from {at:g} s for {disturbance.push_s:g} s; "
                f"valid: within {motion.name}, 0 to {motion.duration:g} s"
            )
        frame = min(round(float(at) * motion.fps), len(motion) - 1)
        angle = float(yaw(motion.qpos[frame, 3:7])) + np.radians(disturbance.push_direction_deg)
        force = disturbance.push_n_per_kg * float(motion.character.model.body_mass.sum())
        pelvis = motion.character.roles["pelvis"]
        pushes = (
            Push(
                pelvis, float(at), disturbance.push_s, (force * float(np.cos(angle)), force * float(np.sin(angle)), 0.0)
            ),
        )
    return SimulationSettings(mpc=replace(mpc, threads=threads), pushes=pushes, mismatch=disturbance.mismatch)


@lru_cache(maxsize=1)
def processor() -> str:
    """Kind of the machine's processor: long simulations differ between kinds."""
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
