"""The motion graph as a JSON file: schema, versions, settings, nodes and transitions."""

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from simprep import __version__
from simprep.controller.graph import KINDS, GraphSettings, MotionGraph, Node, Transition
from simprep.errors import MotionError, SettingError, SimprepError
from simprep.files import atomic_path
from simprep.humanoid_model import MODEL_NAME, MODEL_VERSION
from simprep.motion.edit import resample
from simprep.motion.motion import Motion

SCHEMA = "simprep.motion_graph/1"


class GraphFileError(SimprepError):
    """A motion graph file is missing, malformed or contradicts itself."""

    def __init__(self, path: object, message: str) -> None:
        super().__init__(f"{path}: {message}")


def graph_content(graph: MotionGraph) -> dict[str, Any]:
    """The graph in JSON's types, with schema and versions."""
    return {
        "schema": SCHEMA,
        "simprep": __version__,
        "model": MODEL_NAME,
        "model_version": MODEL_VERSION,
        "settings": asdict(graph.settings),
        "nodes": [asdict(node) for node in graph.nodes],
        "transitions": [asdict(transition) for transition in graph.transitions],
    }


def save_graph(graph: MotionGraph, path: str | Path) -> Path:
    """Write a graph as JSON, atomically; the same graph gives the same bytes."""
    with atomic_path(path) as temporary:
        temporary.write_text(json.dumps(graph_content(graph), indent=1, allow_nan=False) + "\n", encoding="utf-8")
    return Path(path)


def read_graph(path: str | Path) -> MotionGraph:
    """Read a graph written by `save_graph`.

    Raises:
        GraphFileError: missing, no JSON, another schema or model, or a transition without its motion or frame.
    """
    try:
        content = json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise GraphFileError(path, "no such file") from None
    except (OSError, ValueError) as error:
        raise GraphFileError(path, f"not a readable JSON file ({error})") from None
    if not isinstance(content, dict) or content.get("schema") != SCHEMA:
        given = content.get("schema") if isinstance(content, dict) else type(content).__name__
        raise GraphFileError(path, f"schema {given!r}; this version reads {SCHEMA!r}")
    model = (content.get("model"), content.get("model_version"))
    if model != (MODEL_NAME, MODEL_VERSION):
        raise GraphFileError(
            path, f"motions of model {model[0]!r} version {model[1]!r}; valid: {MODEL_NAME!r} version {MODEL_VERSION}"
        )
    try:
        graph = MotionGraph(
            tuple(Node(**node) for node in content["nodes"]),
            tuple(Transition(**transition) for transition in content["transitions"]),
            GraphSettings(**content["settings"]),
        )
        frames = {node.name: node.frames for node in graph.nodes}
        for number, transition in enumerate(graph.transitions):
            _check_transition(path, number, transition, frames)
    except (KeyError, TypeError, AttributeError, SettingError) as error:
        raise GraphFileError(path, f"not a motion graph ({type(error).__name__}: {error})") from None
    return graph


def check_motions(graph: MotionGraph, motions: Mapping[str, Motion]) -> None:
    """Refuse motions by name other than those the graph was made from; more are allowed.

    Raises:
        MotionError: a motion is missing, or has another length or another target movement than the graph says.
    """
    for node in graph.nodes:
        if node.name not in motions:
            raise MotionError(f"the motion graph needs {node.name!r}; valid: one of {', '.join(motions)}")
        motion = resample(motions[node.name], graph.settings.fps)
        marked = None if node.core else motion.events.get("target")
        if (len(motion), marked) != (node.frames, node.target_frame):
            raise MotionError(
                f"{node.name} has {len(motion)} frames and its target movement at {marked}; the motion graph was made for "
                f"{node.frames} and {node.target_frame}: make the graph again"
            )


def _check_transition(path: str | Path, number: int, transition: Transition, frames: Mapping[str, int]) -> None:
    where = f"transition {number} ({transition.source} to {transition.target})"
    if transition.kind not in KINDS:
        raise GraphFileError(path, f"{where}: kind {transition.kind!r}; valid: {', '.join(KINDS)}")
    for name, frame in ((transition.source, transition.source_frame), (transition.target, transition.target_frame)):
        if name not in frames:
            raise GraphFileError(path, f"{where}: no motion {name!r} in the graph; valid: {', '.join(frames)}")
        if not 0 <= frame < frames[name]:
            raise GraphFileError(path, f"{where}: frame {frame} of {name}; valid: 0 to {frames[name] - 1}")
