"""A limit as a replay: the hardest disturbance survived beside the mildest that was not."""

from collections.abc import Hashable

from simprep.motion.kinematics import forward_kinematics
from simprep.physics.pushes import Push
from simprep.physics.run import Run
from simprep.report.figures import COLOURS
from simprep.report.replay.actor import Actor, Flash, Replay, run_actor, side_by_side
from simprep.study.limit_runs import LimitRuns


def limit_replay(title: str, search: Hashable, runs: LimitRuns, dose: str, push: Push | None = None) -> Replay | None:
    """The two runs at the limit of a search, side by side; one where only one is kept, None where none is.

    Args:
        title: of the replay.
        search: as of `LimitRuns.add`.
        runs: the runs kept.
        dose: how a dose is written, such as `{:.0f} N`.
        push: segment and time of the push, if the dose is one; a ball shows it. Its force is not used.
    """
    kept = [(runs.survived.get(search), "survived"), (runs.failed.get(search), "not survived")]
    known = [(dose.format(pair[0]), pair[1], word) for pair, word in kept if pair is not None]
    if not known:
        return None
    actors = side_by_side(
        [run_actor(run, f"{text}, {word}", colour) for (text, run, word), colour in zip(known, COLOURS[2:])]
    )
    flashes = [] if push is None else [_flash(actor, run, push, text) for actor, (text, run, _) in zip(actors, known)]
    return Replay(title, actors, flashes=tuple(flashes))


def _flash(actor: Actor, run: Run, push: Push, text: str) -> Flash:
    character = run.reference.character
    frame = min(round(push.start / run.timestep), run.steps)
    where = forward_kinematics(run.qpos[frame : frame + 1], character).xipos[0]
    x, y, z = where[character.segments.index(push.body)]
    place = (float(x + actor.place[0]), float(y + actor.place[1]), float(z))
    return Flash(push.start, push.duration, place, 0.14, text)
