"""How a synthetic stream fights, in numbers that can be put beside those of real pairs."""

from typing import Any

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.stream.stream import facing_error, root_distance
from simprep.duel.synthetic.kinds import KIND_NAMES, KIND_OF, context_of
from simprep.duel.synthetic.make import SyntheticStream

PERCENTILES = (10, 25, 50, 75, 90)


def summarise_synthetic(made: SyntheticStream) -> dict[str, Any]:
    """Numbers about a synthetic stream.

    Returns:
        | key | meaning |
        | --- | --- |
        | `segments`, `labels`, `clips`, `frames`, `fps`, `minutes` | size |
        | `kinds` | number of actions of each kind |
        | `attacks_per_min` | punches and kicks begun per minute, of A and of B |
        | `duration_s` | percentiles of the length of actions |
        | `strike_distance_m` | of the roots when a fist or foot is out farthest, percentiles |
        | `reaction_s` | from the beginning of an attack to that of the first fitting action during it, percentiles |
        | `answered_share` | attacks during which the opponent begins a fitting reaction |
        | `facing_deg` | of the pelvis from the direction of the other, percentiles |
        | `foot_missed_mm` | how far a supporting foot misses its place (short legs): 99th percentile, largest |
    """
    stream, truth = made.stream, made.truth
    kinds = [KIND_OF[tuple(int(index) for index in row)] for row in truth.qualifiers]
    contexts = np.array([context_of(kind) for kind in kinds])
    start, end = truth.table[:, 1], truth.table[:, 2]
    # a quick punch is out farthest in its middle, the others at their end
    out = np.array([(a + b) // 2 if kind.endswith("fwdbwd") else b for kind, a, b in zip(kinds, start, end)])
    distance, fps = root_distance(stream), stream.fps
    minutes = stream.duration / 60
    fitting = truth.fitting()
    reaction: dict[str, list[float]] = {"punch": [], "kick": []}
    answered = []
    for row in np.flatnonzero(np.isin(contexts, ("punch", "kick"))):
        answering = np.flatnonzero((truth.answers == row) & fitting)
        answered.append(bool(len(answering)))
        if len(answering):
            reaction[str(contexts[row])].append(float(start[answering].min() - start[row]) / fps)
    return {
        "source": stream.players[0].source,
        "segments": len(start),
        "labels": len(np.unique(truth.codes)),
        "clips": len(stream.clips),
        "frames": len(stream),
        "fps": fps,
        "minutes": minutes,
        "kinds": {kind: kinds.count(kind) for kind in KIND_NAMES},
        "attacks_per_min": {
            kind: [float(np.sum((contexts == kind) & (truth.table[:, 0] == player)) / minutes) for player in range(2)]
            for kind in ("punch", "kick")
        },
        "duration_s": _percentiles((end - start) / fps),
        "strike_distance_m": {
            kind: _percentiles(distance[np.minimum(out[contexts == kind], len(distance) - 1)])
            for kind in ("punch", "kick")
        },
        "reaction_s": {kind: _percentiles(np.array(times)) for kind, times in reaction.items()},
        "answered_share": float(np.mean(answered)),
        "facing_deg": _percentiles(np.degrees(np.abs(facing_error(stream)).ravel())),
        "foot_missed_mm": [float(1000 * np.percentile(made.missed_m, share)) for share in (99, 100)],
    }


def _percentiles(values: FloatArray) -> dict[str, float]:
    if not len(values):
        return {}
    return {str(share): float(value) for share, value in zip(PERCENTILES, np.percentile(values, PERCENTILES))}
