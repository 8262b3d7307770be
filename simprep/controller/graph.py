"""Hierarchical motion graph: core nodes and target motions (2013 paper, section 4.1, Fig. 3).

An edge joins two frames in which the same feet support, at a local minimum of the distance between the bodies, aligned
in plan and heading (Kovar et al. 2002; their point clouds are here the origins of the segments). Core nodes are joined
with each other, with a target before its target movement, and with a target after its last event.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import permutations
from typing import Any, Literal

import numpy as np
from scipy.ndimage import minimum_filter
from scipy.spatial.distance import cdist

from simprep.arrays import FloatArray
from simprep.display import SelfShowing, data_frame
from simprep.errors import MotionError, SettingError, UnknownNameError
from simprep.motion.edit import repeat, resample
from simprep.motion.motion import Motion
from simprep.preparation.reference_posture import reference_posture
from simprep.preparation.transition import VELOCITY_S, local_state

KINDS = ("core", "entry", "prepared", "exit")


@dataclass(frozen=True)
class GraphSettings:
    """What counts as a transition.

    Attributes:
        threshold: largest distance of a transition [m]: root mean square over the segments of the difference of their
            origins, and of their velocities times 0.1 s. 0.2 m lets a walk end in quiet standing.
        apart: least time between two transitions of the same pair of motions, in either of them [s].
        fps: frame rate at which the motions are compared and frames are counted [1/s].

    Raises:
        SettingError: a value that is not positive.
    """

    threshold: float = 0.2
    apart: float = 0.1
    fps: float = 60.0

    def __post_init__(self) -> None:
        for name in ("threshold", "apart", "fps"):
            if not getattr(self, name) > 0:
                raise SettingError(f"motion graph: {name} {getattr(self, name)}; valid: above 0")


@dataclass(frozen=True)
class Node:
    """A motion of the graph; the last three are None for a core node.

    Attributes:
        name: of the motion.
        core: cyclic locomotion; otherwise a target.
        frames: its length at the graph's frame rate.
        target_frame: first frame of the target movement (T_t).
        reference_frame: frame of its reference posture (T_p).
        exit_frame: first frame from which it may be left: after its last event and the middle of `target_frame` and
            end.
    """

    name: str
    core: bool
    frames: int
    target_frame: int | None = None
    reference_frame: int | None = None
    exit_frame: int | None = None


@dataclass(frozen=True)
class Transition:
    """An edge: from a frame of one motion to a frame of another.

    Attributes:
        source: name of the motion left.
        source_frame: its frame in whose place the other begins.
        target: name of the motion entered.
        target_frame: its frame that is entered.
        distance: between the two frames, as in `GraphSettings.threshold` [m].
        kind: `core` between core nodes; `entry` from a core node into a target before its target movement; `prepared`
            from a core node into a target's reference posture, at any distance, as preparation makes it small; `exit`
            from a target to a core node.
    """

    source: str
    source_frame: int
    target: str
    target_frame: int
    distance: float
    kind: str


@dataclass(frozen=True)
class MotionGraph(SelfShowing):
    """Nodes, core nodes first; transitions, sorted by source, target, kind, then distance; and settings."""

    nodes: tuple[Node, ...]
    transitions: tuple[Transition, ...]
    settings: GraphSettings = GraphSettings()

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(graph)` and Jupyter show."""
        return "motion graph", {
            "core nodes": ", ".join(self.core),
            "targets": len(self.targets),
            **{f"transitions, {kind}": sum(one.kind == kind for one in self.transitions) for kind in KINDS},
        }

    def to_dataframe(self) -> Any:
        """A pandas DataFrame of the transitions: between which frames, how far apart [m], and of which kind."""
        return data_frame([asdict(one) for one in self.transitions])

    @property
    def core(self) -> tuple[str, ...]:
        """Names of the core nodes."""
        return tuple(node.name for node in self.nodes if node.core)

    @property
    def targets(self) -> tuple[str, ...]:
        """Names of the target motions."""
        return tuple(node.name for node in self.nodes if not node.core)

    def node(self, name: str) -> Node:
        """The node of a motion; UnknownNameError if the graph has no such motion."""
        for node in self.nodes:
            if node.name == name:
                return node
        raise UnknownNameError("motion of the graph", name, (node.name for node in self.nodes))

    def between(self, source: str, target: str, kind: str | None = None) -> tuple[Transition, ...]:
        """Transitions from one motion to another, nearest first; those of one kind, or of all.

        Raises:
            UnknownNameError: no such motion, or no such kind.
        """
        self.node(source), self.node(target)
        if kind is not None and kind not in KINDS:
            raise UnknownNameError("kind of transition", kind, KINDS)
        found = [t for t in self.transitions if (t.source, t.target) == (source, target) and kind in (None, t.kind)]
        return tuple(sorted(found, key=lambda t: (t.distance, t.source_frame, t.target_frame)))

    def unreachable(self) -> tuple[str, ...]:
        """Targets into which no transition under the threshold leads from any core node."""
        entered = {t.target for t in self.transitions if t.kind == "entry"}
        return tuple(name for name in self.targets if name not in entered)

    def dead_ends(self) -> tuple[str, ...]:
        """Targets from which no transition under the threshold leads back to a core node."""
        left = {t.source for t in self.transitions if t.kind == "exit"}
        return tuple(name for name in self.targets if name not in left)


def build_graph(
    core: Sequence[Motion], targets: Iterable[Motion], settings: GraphSettings | None = None
) -> MotionGraph:
    """Find every transition between core nodes, and between core nodes and targets.

    Args:
        core: cyclic locomotion, the core nodes (paper: 4).
        targets: motions with the event `target`.
        settings: threshold and frame rate.

    Raises:
        MotionError: no core node, a core node that is no loop, a target without a marked target movement, two motions
            of one name, or motions of different bodies.
    """
    settings = settings or GraphSettings()
    loops = [resample(motion, settings.fps) for motion in core]
    others = [resample(replace(motion, loop=False), settings.fps) for motion in targets]
    _refuse_unfit(loops, others)
    nodes = [Node(motion.name, True, len(motion)) for motion in loops]
    nodes += [_target_node(motion) for motion in others]
    at = {node.name: node for node in nodes}
    features = {motion.name: pose_features(motion) for motion in (*loops, *others)}
    found: list[Transition] = []
    for a, b in permutations(loops, 2):
        found += _transitions(a, b, features, "core", settings)
    for loop in loops:
        for other in others:
            node = at[other.name]
            assert node.target_frame is not None
            assert node.reference_frame is not None
            assert node.exit_frame is not None
            found += _transitions(loop, other, features, "entry", settings, after=(0, node.target_frame + 1))
            reference = (node.reference_frame, node.reference_frame + 1)
            found += _transitions(loop, other, features, "prepared", settings, after=reference)
            found += _transitions(other, loop, features, "exit", settings, before=(node.exit_frame, node.frames))
    found.sort(key=lambda t: (t.source, t.target, t.kind, t.distance, t.source_frame, t.target_frame))
    return MotionGraph(tuple(nodes), tuple(found), settings)


def pose_features(motion: Motion) -> FloatArray:
    """Coordinates (T, 6 S) whose Euclidean distance is that of `GraphSettings.threshold` [m].

    Positions and 0.1 s times velocities of the S segments, aligned in plan and heading, over sqrt(S). A loop's last
    frame precedes its first.
    """
    n = len(motion)
    if motion.loop:
        position, velocity = (part[n : 2 * n] for part in local_state(repeat(motion, 3)))
    else:
        position, velocity = local_state(motion)
    parts = np.stack([position, VELOCITY_S * velocity], axis=-1).reshape(n, -1)
    return np.asarray(parts / np.sqrt(position.shape[1]))


def pair_distances(source: Motion, target: Motion, features: Mapping[str, FloatArray] | None = None) -> FloatArray:
    """Distance (S, T) of every frame of one motion to every frame of another [m]; infinite where other feet support.

    Args:
        source: S frames.
        target: T frames.
        features: `pose_features` of both by name, where they are known.
    """
    features = features or {motion.name: pose_features(motion) for motion in (source, target)}
    distance = cdist(features[source.name], features[target.name])
    same = (source.contacts[:, None] == target.contacts[None]).all(axis=2)
    return np.asarray(np.where(same, distance, np.inf))


def _transitions(
    source: Motion,
    target: Motion,
    features: Mapping[str, FloatArray],
    kind: str,
    settings: GraphSettings,
    before: tuple[int, int] | None = None,
    after: tuple[int, int] | None = None,
) -> list[Transition]:
    """Local minima of the distance among frames with the same feet supporting; `before`, `after`: allowed frames."""
    first, last = before or (0, len(source))
    begin, end = after or (0, len(target))
    distance = pair_distances(source, target, features)[first:last, begin:end]
    size = 2 * max(1, round(settings.apart * settings.fps)) + 1
    modes: list[Literal["wrap", "nearest"]] = ["wrap" if motion.loop else "nearest" for motion in (source, target)]
    lowest = minimum_filter(distance, size, mode=modes)
    limit = np.inf if kind == "prepared" else settings.threshold
    pairs = np.argwhere((distance <= lowest) & (distance < np.inf) & (distance <= limit))
    kept: list[tuple[int, int]] = []
    for i, j in sorted(pairs.tolist(), key=lambda pair: (distance[pair[0], pair[1]], pair)):
        # a motion that holds still has plateaus of equal minima: keep the first
        if all(max(_gap(i, a, source), _gap(j, b, target)) > size // 2 for a, b in kept):
            kept.append((i, j))
    return [Transition(source.name, i + first, target.name, j + begin, float(distance[i, j]), kind) for i, j in kept]


def _gap(a: int, b: int, motion: Motion) -> int:
    gap = abs(a - b)
    return min(gap, len(motion) - gap) if motion.loop else gap


def _target_node(motion: Motion) -> Node:
    reference = reference_posture(motion)
    over = max(max(motion.events.values()) + 1, (reference.target_frame + len(motion)) // 2)
    after = min(over, len(motion) - 1)
    return Node(motion.name, False, len(motion), reference.target_frame, reference.frame, after)


def _refuse_unfit(core: Sequence[Motion], targets: Sequence[Motion]) -> None:
    if not core:
        raise MotionError("a motion graph without core nodes; valid: at least one cyclic locomotion")
    for motion in core:
        if not motion.loop:
            raise MotionError(f"{motion.name} is no loop; core nodes of a motion graph are cyclic locomotion")
    motions = (*core, *targets)
    names = [motion.name for motion in motions]
    for name in names:
        if names.count(name) > 1:
            raise MotionError(f"{name} is in the motion graph twice; valid: every motion once")
    for motion in motions:
        if motion.character != core[0].character:
            raise MotionError(
                f"{motion.name} and {core[0].name} belong to different bodies: {motion.character}, {core[0].character}"
            )
