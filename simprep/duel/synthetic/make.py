"""The built-in synthetic stream: clips drawn, performed, joined, and given the noise of a measurement."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d
from scipy.spatial.transform import Rotation

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.character import Character
from simprep.duel.stream.stream import DuelStream
from simprep.duel.synthetic.generating_model import GeneratingModel, kind_table
from simprep.duel.synthetic.perform import Performance, perform
from simprep.duel.synthetic.planned import FPS, Fighter
from simprep.duel.synthetic.presets import SyntheticSettings
from simprep.duel.synthetic.schedule import draw_clip
from simprep.duel.synthetic.truth import Truth
from simprep.humanoid_model import humanoid
from simprep.motion.motion import Motion
from simprep.motion.rotations import multiply_quat

SOURCE = "synthetic: choreographed from simprep's built-in motions, not a recording"


@dataclass(frozen=True)
class SyntheticStream:
    """A made stream.

    Attributes:
        stream: two fighters.
        truth: what is known about it.
        missed_m: (T, 2) how far the worse supporting foot of A and B is from where it should be [m].
    """

    stream: DuelStream
    truth: Truth
    missed_m: FloatArray


def make_synthetic(
    settings: SyntheticSettings, seed: int = 0, progress: Callable[[int, int], None] | None = None
) -> SyntheticStream:
    """Make a synthetic stream with its truth.

    Args:
        settings: see `simprep.duel.synthetic.presets.PRESETS`.
        seed: the same seed gives the same stream; clip k depends on the seed and k alone.
        progress: called with the number of clips made and of all.
    """
    first, second = (GeneratingModel(kind_table(temper), settings.footing) for temper in settings.tempers)
    generators, character = (first, second), humanoid()
    step = round(FPS / settings.fps)
    qpos: tuple[list[FloatArray], list[FloatArray]] = ([], [])
    contacts: tuple[list[BoolArray], list[BoolArray]] = ([], [])
    rows: list[list[int]] = []
    variants: list[str] = []
    missed, seams, offset = [], [], 0
    for clip in range(settings.clips):
        rng = np.random.default_rng([seed, clip])
        fighters = draw_clip(settings, generators, rng)
        parts = [perform(fighter, rng) for fighter in fighters]
        for player, part in enumerate(parts):
            qpos[player].append(_measured(part.qpos[::step], settings, character, rng))
            contacts[player].append(part.contacts[::step])
        missed.append(np.stack([part.missed_m[::step] for part in parts], axis=1))
        found, names = _rows(fighters, parts, clip, step, offset)
        rows += found
        variants += names
        offset += len(qpos[0][-1])
        seams.append(offset)
        if progress is not None:
            progress(clip + 1, settings.clips)
    name = f"{settings.name}_{seed}"
    a, b = (
        Motion(
            np.concatenate(poses),
            settings.fps,
            np.concatenate(feet),
            name=f"{name}_{who}",
            source=SOURCE,
            character=character,
        )
        for poses, feet, who in zip(qpos, contacts, "ab")
    )
    stream = DuelStream((a, b), tuple(seams[:-1]), tuple(f"round {k + 1}" for k in range(settings.clips)), name)
    truth = _truth(settings, seed, stream, np.array(rows, dtype=np.int64), variants, generators)
    return SyntheticStream(stream, truth, np.concatenate(missed))


def _rows(
    fighters: tuple[Fighter, Fighter], parts: list[Performance], clip: int, step: int, offset: int
) -> tuple[list[list[int]], list[str]]:
    """Player, start, end, clip, code, clip's number of the answered action, peak of every action; and its variant."""
    rows, variants = [], []
    for player, (fighter, part) in enumerate(zip(fighters, parts)):
        for action, peak, variant in zip(fighter.done, part.peaks, part.variants):
            start, end = offset + action.start // step, offset + -(-action.end // step)
            rows.append([player, start, end, clip, action.code, action.answers, offset + int(peak) // step])
            variants.append(variant)
    return rows, variants


def _truth(
    settings: SyntheticSettings,
    seed: int,
    stream: DuelStream,
    rows: IntArray,
    variants: list[str],
    generators: tuple[GeneratingModel, GeneratingModel],
) -> Truth:
    order = np.lexsort((rows[:, 1], rows[:, 0]))
    rows = rows[order]
    answers = np.full(len(rows), -1, dtype=np.int64)
    for number, (player, _, _, clip, _, within, _) in enumerate(rows):
        if within >= 0:  # counted within the clip so far
            theirs = np.flatnonzero((rows[:, 0] != player) & (rows[:, 3] == clip))
            answers[number] = theirs[within]
    return Truth(
        stream.name, len(stream), settings.name, seed, rows[:, :4], rows[:, 4], answers, rows[:, 6],
        tuple(variants[index] for index in order), generators,
    )  # fmt: skip


def _measured(
    qpos: FloatArray, settings: SyntheticSettings, character: Character, rng: np.random.Generator
) -> FloatArray:
    """Poses with the noise of a measurement."""
    spread = np.radians(settings.joint_noise_deg)
    noise = rng.normal(size=(len(qpos), character.nv))
    sigma = settings.noise_s * settings.fps
    if sigma > 0:
        noise = gaussian_filter1d(noise, sigma, axis=0, mode="wrap")
        noise /= noise.std()
    out = qpos.copy()
    out[:, :3] += settings.root_noise_m * noise[:, :3]
    turn = Rotation.from_rotvec(spread * noise[:, 3:6]).as_quat(scalar_first=True)
    out[:, 3:7] = multiply_quat(out[:, 3:7], turn)
    low, high = character.model.jnt_range[1:].T
    out[:, 7:] = np.clip(out[:, 7:] + spread * noise[:, 6:], low, high)
    return out
