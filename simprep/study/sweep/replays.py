"""Replays of a sweep: arms side by side, or controllers. Records hold numbers only, so a few cases are simulated again."""

from collections.abc import Hashable, Iterable, Mapping, Sequence
from typing import Any

from simprep.errors import SimprepError
from simprep.motion.motion import Motion
from simprep.report.figures import COLOURS
from simprep.report.replay.actor import Actor, Replay, event_marks, run_actor, side_by_side
from simprep.study.plan import ARM_LABELS, BEFORE_PHYSICS
from simprep.study.sweep.cases import SweepCase
from simprep.study.sweep.measure import BAD_INPUT, ERROR, case_result

GROUPS = 3
"""Most replays."""
BUDGET_S = 40.0
"""What their simulations took at most when they were recorded [s of processor time]."""
SHOWN_EVENTS = ("rise", "launch", "impact")


def sweep_replays(
    cases: Iterable[SweepCase], records: Sequence[Mapping[str, Any]], threads: int = 0, budget_s: float = BUDGET_S
) -> list[Replay]:
    """The first groups of a sweep that are cheap enough to be simulated again.

    Args:
        cases: of the sweep.
        records: of its store.
        threads: simulation threads of `mpc`; 0 for all cores. Does not change what is shown.
        budget_s: processor time [s], as recorded.

    Returns:
        A replay of each group, fewer where cases cannot be run any more; nothing where all are too dear.
    """
    costs = {one["id"]: one["cost"]["cpu_s"] for one in records if one["end"] not in (BAD_INPUT, ERROR)}
    replays: list[Replay] = []
    left = budget_s
    for group in groups([case for case in cases if case.id in costs]):
        cost = sum(costs[case.id] or 0.0 for case in group)
        if len(replays) == GROUPS or cost > left:
            continue
        left -= cost
        try:
            replays.append(_replay(group, threads))
        except SimprepError:  # a file that is gone since
            continue
    return replays


def groups(cases: Iterable[SweepCase]) -> list[list[SweepCase]]:
    """Cases that belong side by side, what is simulated first: the arms of a preparation at its highest level; the controllers of a clip."""
    found: dict[Hashable, dict[str, SweepCase]] = {}
    for case in cases:
        apart = (case.clip, case.locomotion, case.target, case.body, case.seed, case.disturbance)
        if case.clip is not None:
            found.setdefault((apart, case.controller == BEFORE_PHYSICS), {})[case.controller] = case
            continue
        arms = found.setdefault((apart, case.controller), {})
        known = arms.get(case.arm or "")
        if known is None or (case.alpha or 0.0) > (known.alpha or 0.0):
            arms[case.arm or ""] = case
    made = [list(group.values()) for group in found.values()]
    return sorted(made, key=lambda group: group[0].controller == BEFORE_PHYSICS)


def _replay(group: Sequence[SweepCase], threads: int) -> Replay:
    actors: list[Actor] = []
    marks: tuple[tuple[str, float], ...] = ()
    for case, colour in zip(group, COLOURS):
        label = case.controller if case.arm is None else ARM_LABELS[case.arm]
        made = case_result(case, threads)
        motion = made if isinstance(made, Motion) else made.reference
        marks = tuple(mark for mark in event_marks(motion) if mark[0] in SHOWN_EVENTS)
        actors.append(
            Actor(f"{label}, not simulated", made, colour=colour)
            if isinstance(made, Motion)
            else run_actor(made, label, colour)
        )
    return Replay(group_title(group[-1]), side_by_side(actors), marks=marks)


def group_title(case: SweepCase) -> str:
    """What the cases of a group have in common, in words."""
    if case.clip is not None:
        what = case.clip.name
    else:
        level = "" if case.alpha is None else f", α {case.alpha:g}"
        assert case.locomotion is not None
        assert case.target is not None
        what = f"{case.locomotion.name} to {case.target.name}{level}, {case.controller}"
    stature = "" if case.body.height_m is None else f", {case.body.height_m:g} m"
    return f"{what}, {case.disturbance.name.replace('_', ' ')}{stature}"
