"""The world of the built-in motions: core nodes, targets, graph and a policy, ready for approaches."""

from collections.abc import Iterable

from simprep.controller.best import best_policy
from simprep.controller.cores import core_motions
from simprep.controller.graph import GraphSettings, MotionGraph, build_graph
from simprep.controller.policy import Policy
from simprep.controller.runtime.locomotion import CoreNodes
from simprep.controller.runtime.performer import RuntimeSettings
from simprep.controller.runtime.task import World
from simprep.controller.settings import ControllerSettings
from simprep.errors import UnknownNameError
from simprep.library import library_motion
from simprep.library.registry import library_entries
from simprep.motion.motion import Motion
from simprep.preparation.reference_posture import TARGET_EVENT


def target_names() -> tuple[str, ...]:
    """Built-in motions that can be targets: those of every family but locomotion."""
    return tuple(entry.name for entry in library_entries() if entry.family != "locomotion")


def library_graph(settings: GraphSettings | None = None, controller: ControllerSettings | None = None) -> MotionGraph:
    """The motion graph of the controller's core nodes and all built-in targets."""
    cores = core_motions(controller or ControllerSettings())
    motions = (library_motion(name) for name in target_names())
    # a stance or footwork without a target movement cannot be prepared for
    return build_graph(
        cores, (motion for motion in motions if TARGET_EVENT in motion.events and not motion.loop), settings
    )


def library_world(
    targets: Iterable[str | Motion],
    settings: RuntimeSettings | None = None,
    policy: Policy | None = None,
    prepare: bool = True,
) -> World:
    """A world of built-in motions.

    Args:
        targets: names of the target motions that it needs, UnknownNameError for others than `target_names`; or motions of your
            own, which go by their own names.
        settings: of the synthesis.
        policy: None for the best policy of the quantised model (value iteration).
        prepare: False for the plain motion graph.
    """
    motions = {}
    for one in targets:
        if isinstance(one, str) and one not in target_names():
            raise UnknownNameError("target", one, target_names())
        motion = library_motion(one) if isinstance(one, str) else one
        motions[motion.name] = motion
    policy = policy or best_policy()
    cores = core_motions(policy.settings)
    graph = build_graph(cores, motions.values())
    nodes = CoreNodes({core.name: core for core in cores}, graph)
    return World(nodes, motions, graph, policy, policy.action_frames, settings or RuntimeSettings(), prepare)
