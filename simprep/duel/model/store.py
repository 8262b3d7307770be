"""Saved duel models: one .npz with a schema version, checked when it is read."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from simprep.archive import open_archive, write_archive
from simprep.duel.labels.labels import QUALIFIERS
from simprep.duel.model.action_features import PoseBasis
from simprep.duel.model.estimates import LabelEstimate, LogLinear, Ruled, fit_label_model
from simprep.duel.model.label_model import LabelTriples
from simprep.duel.model.semi_tied import ClassGaussians
from simprep.duel.model.structures import PLAYERS, CoupledGraph, couple, link_actions
from simprep.duel.model.transition_model import DuelModel, TransitionModel, player_model
from simprep.errors import MotionFileError

SCHEMA = "simprep.duel_model/1"

_SEGMENTS = ("player", "start", "end", "label", "clip")
_BASIS = ("mean", "components", "explained")
_TRIPLES = ("own", "opponent", "next")
_SCORES = ("own_score", "opponent_score")
_GAUSSIANS = ("classes", "mean", "covariance")


def save_model(model: DuelModel, path: str | Path, stream_sha256: str = "") -> Path:
    """Write a model to .npz, atomically, and return its path; `.npz` is appended if missing.

    `stream_sha256` is the digest of the stream it was learned from (`fight_model.stream_digest`); empty: none.
    """
    header = {
        "schema": SCHEMA,
        "fps": model.fps,
        "goal_delay_s": model.goal_delay,
        "stream_sha256": stream_sha256,
        "qualifiers": {aspect: list(names) for aspect, names in QUALIFIERS.items()},
        "label_model": [player.labels.kind for player in model.players],
        "reaches_goals": [player.goal_gaussians is not None for player in model.players],
    }
    parts: dict[str, NDArray[Any]] = {"parameters": model.parameters}
    parts |= {f"segment_{name}": getattr(model.graph.actions, name) for name in _SEGMENTS}
    parts |= {f"basis_{name}": getattr(model.basis, name) for name in _BASIS}
    for player in model.players:
        parts |= {f"triple_{name}_{player.player}": getattr(player.labels.triples, name) for name in _TRIPLES}
        scores = player.labels.base if isinstance(player.labels, Ruled) else player.labels
        if isinstance(scores, LogLinear):
            parts |= {f"{name}_{player.player}": getattr(scores, name) for name in _SCORES}
        for kind, gaussians in (("gaussian", player.gaussians), ("goal", player.goal_gaussians)):
            if gaussians is not None:
                parts |= {f"{kind}_{name}_{player.player}": getattr(gaussians, name) for name in _GAUSSIANS}
    return write_archive(path, header, parts)


def read_model(path: str | Path) -> DuelModel:
    """Read a model written by `save_model`.

    Raises:
        MotionFileError: missing, not ours, another schema version, other label qualifiers, or damaged.
    """
    with open_archive(path, "duel model", SCHEMA) as (header, archive):
        # label codes mean nothing under another table of qualifiers
        if header["qualifiers"] != {aspect: list(names) for aspect, names in QUALIFIERS.items()}:
            raise MotionFileError(path, "labels with other qualifiers than this version's")
        parts = {name: archive[name] for name in archive.files}
        bad = [name for name, part in parts.items() if part.dtype.kind == "f" and not np.isfinite(part).all()]
        if bad:
            raise MotionFileError(path, f"{bad[0]} holds NaN or infinity")
        return _assemble(header, parts)


def learned_from(path: str | Path) -> str:
    """Digest of the stream that a saved model was learned from; empty where the file does not say.

    Raises:
        MotionFileError: as `read_model`.
    """
    with open_archive(path, "duel model", SCHEMA) as (header, _):
        return str(header.get("stream_sha256", ""))


def _assemble(header: dict[str, Any], parts: dict[str, NDArray[Any]]) -> DuelModel:
    graph = couple(link_actions(*(parts[f"segment_{name}"] for name in _SEGMENTS)))
    if parts["parameters"].shape[:1] != (len(graph.actions),):
        raise ValueError(f"parameters of {len(parts['parameters'])} actions for {len(graph.actions)} segments")
    first, second = (
        _player(graph, parts, player, header["label_model"][player], header["reaches_goals"][player])
        for player in PLAYERS
    )
    return DuelModel(
        fps=float(header["fps"]),
        goal_delay=float(header["goal_delay_s"]),
        graph=graph,
        basis=PoseBasis(*(parts[f"basis_{name}"] for name in _BASIS)),
        parameters=parts["parameters"],
        players=(first, second),
    )


def _player(
    graph: CoupledGraph, parts: dict[str, NDArray[Any]], player: int, kind: str, reaches_goals: bool
) -> TransitionModel:
    triples = LabelTriples(*(parts[f"triple_{name}_{player}"] for name in _TRIPLES))
    own, opponent = graph.graphs[player].labels, graph.graphs[1 - player].labels
    labels: LabelEstimate
    if kind in (LogLinear.kind, Ruled.kind):
        labels = LogLinear(triples, own, opponent, *(parts[f"{name}_{player}"] for name in _SCORES))
        if kind == Ruled.kind:
            labels = Ruled(triples, own, opponent, labels)
    else:
        labels = fit_label_model(triples, own, opponent, kind)
    gaussians = ClassGaussians(*(parts[f"gaussian_{name}_{player}"] for name in _GAUSSIANS))
    goal_gaussians = None
    if reaches_goals:
        goal_gaussians = ClassGaussians(*(parts[f"goal_{name}_{player}"] for name in _GAUSSIANS))
    return player_model(graph, parts["parameters"], player, labels, gaussians, goal_gaussians)
