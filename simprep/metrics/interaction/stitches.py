"""How smoothly one action goes over into the next: accelerations around the beginnings of actions."""

from dataclasses import dataclass

import numpy as np

from simprep.arrays import BoolArray, FloatArray, IntArray
from simprep.duel.stream.stream import DuelStream
from simprep.metrics.smoothing import DYNAMICS_SIGMA_S, smooth_motion
from simprep.motion.edit import cut

WINDOW_S = 0.1
"""Looked at before and after the first frame of an action [s]."""


@dataclass(frozen=True)
class Stitches:
    """Largest accelerations within 0.1 s before and after the beginnings of actions.

    Attributes:
        linear: (N,) of the root [m/s^2].
        angular: (N,) of the root's rotation [rad/s^2].
        hinge: (N,) root mean square over the hinges [rad/s^2].
    """

    linear: FloatArray
    angular: FloatArray
    hinge: FloatArray

    def __len__(self) -> int:
        return len(self.linear)


def stitches(
    stream: DuelStream, table: IntArray, rows: BoolArray | None = None, sigma: float = DYNAMICS_SIGMA_S
) -> Stitches:
    """Peaks around the beginnings of actions of all players; none less than the window from the end of a clip.

    Motions pass a Gaussian (`simprep.metrics.smoothing`), so frame rates do not matter. With 20 ms it passes half of an
    amplitude at 9 Hz and turns a step of velocity v into a peak of 20 v per second: shorter jolts measure smaller.

    Args:
        stream: of two people or more.
        table: (S, 4) player, first frame, frame after the last, clip.
        rows: (S,) which actions' beginnings to look at; None for all. Of a synthesised fight leave out examples that
            follow their own predecessor: there is no stitch.
        sigma: standard deviation of the Gaussian [s].
    """
    table = np.asarray(table, dtype=np.int64)
    wanted = table if rows is None else table[rows]
    peaks: list[FloatArray] = []
    for player, motion in enumerate(stream.players):
        for clip, (first, after) in enumerate(stream.bounds):
            starts = wanted[(wanted[:, 0] == player) & (wanted[:, 3] == clip), 1] - first
            if not len(starts) or after - first < 3:
                continue
            smooth = smooth_motion(cut(motion, int(first), int(after)), sigma=sigma)
            inner = smooth.interior
            times = starts / motion.fps
            whole = (times - WINDOW_S >= smooth.time[inner][0]) & (times + WINDOW_S <= smooth.time[inner][-1])
            acceleration = np.stack(
                [
                    np.linalg.norm(smooth.qacc[:, :3], axis=1),
                    np.linalg.norm(smooth.qacc[:, 3:6], axis=1),
                    np.sqrt(np.mean(smooth.qacc[:, 6:] ** 2, axis=1)),
                ],
                axis=1,
            )
            # times and grid differ by less than half a sample
            edges = np.searchsorted(smooth.time, [times[whole] - WINDOW_S - 1e-9, times[whole] + WINDOW_S + 1e-9])
            peaks += [acceleration[low:high].max(axis=0) for low, high in edges.T]
    found = np.stack(peaks) if peaks else np.empty((0, 3))
    return Stitches(found[:, 0], found[:, 1], found[:, 2])


def compare_stitches(fight: Stitches, recorded: Stitches) -> dict[str, float]:
    """Stitches of a fight over those of a recorded stream, at the beginnings of its own actions.

    By name `linear_median_ratio`, `linear_p95_ratio`, the same of `angular` and `hinge`; NaN where either has none.

    Args:
        fight: of a fight, or several together.
        recorded: of the recorded stream.
    """
    out = {}
    for name in ("linear", "angular", "hinge"):
        ours, theirs = getattr(fight, name), getattr(recorded, name)
        for word, share in (("median", 50), ("p95", 95)):
            known = len(ours) and len(theirs)
            ratio = np.percentile(ours, share) / np.percentile(theirs, share) if known else np.nan
            out[f"{name}_{word}_ratio"] = float(ratio)
    return out
