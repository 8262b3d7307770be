"""Synthesis of a fight: whoever ends an action chooses the next, which is placed, warped, stitched and played.

Source: the 2008 paper, section 5.1. A `Chooser` for each fighter says what comes next (`simprep.duel.fight.choice`).

    examples = ExampleMotions.of(stream, model)
    choosers = tuple(ModelChooser(player) for player in model.players)
    fight = synthesise(examples, choosers, 60.0, np.random.default_rng(0))

A `Bout` is stepped instead, to act while a fight goes on.
"""

from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

from simprep.arrays import BoolArray, FloatArray
from simprep.duel.fight.choice import Choice, Chooser, Situation
from simprep.duel.fight.example_motions import ExampleMotions
from simprep.duel.fight.fight import NONE, Fight, FightAction
from simprep.duel.fight.fighter_track import FighterTrack, Performed
from simprep.duel.fight.floor_move import FloorMove, GradualMove
from simprep.duel.fight.pace import PaceSettings, pace_of
from simprep.duel.fight.placement import Aim, place
from simprep.duel.fight.stitch import Seam, StitchSettings, plant, stitch
from simprep.duel.fight.strikes import bent, strike_of
from simprep.duel.fight.time_warp import Warp, WarpSettings, fit_warp
from simprep.duel.model.action_features import FloorFrame, action_parameters, floor_frame
from simprep.duel.model.tracks import local_joints
from simprep.duel.stream.stream import DuelStream, player_name
from simprep.errors import SettingError
from simprep.motion.edit import yaw
from simprep.motion.kinematics import Kinematics, forward_kinematics
from simprep.motion.motion import Motion
from simprep.motion.rotations import multiply_quat
from simprep.motion.turns import about_vertical, turned

CONTEXT = 2
"""Frames played beyond the end of an action: where the next begins, and one for its velocity."""


@dataclass(frozen=True)
class SynthesisSettings:
    """How fights are made.

    Attributes:
        stitch: of actions.
        warp: of time; None never warps.
        longest_drift_m: farthest drift towards a wished position within an action [m].
        reach_m: how far an attacker is drawn at most to or from the opponent for a strike to meet its target [m]; 0: not.
        pace: how fast feet may go; None: as fast as recorded.
        acceleration: largest one of the root by drifts, but for those that a user asks for [m/s^2].
    """

    stitch: StitchSettings = field(default_factory=StitchSettings)
    warp: WarpSettings | None = field(default_factory=WarpSettings)
    longest_drift_m: float = 0.6
    reach_m: float = 0.0
    pace: PaceSettings | None = None
    acceleration: float = np.inf


class Bout:
    """A fight in the making. Deterministic from the source of chance.

    Args:
        examples: actions to perform.
        choosers: of both fighters, asked whenever an action of theirs ends; may return any action of the examples that
            the fighter's own body performed, appended recordings included.
        rng: the only source of chance.
        start: frame of the recordings at which the fight begins, in the midst of actions; None draws one at which both
            stand in guard (`ExampleMotions.start_frame`).
        settings: None for the defaults.

    Attributes:
        known_s: time of what a user has asked for so far [s]; None: every request counts from its time on.
        astray: where each fighter's body is against what was drawn; None: there.

    Raises:
        MotionError: a start outside the recordings, or none in guard.
    """

    def __init__(
        self,
        examples: ExampleMotions,
        choosers: tuple[Chooser, ...],
        rng: np.random.Generator,
        start: int | None = None,
        settings: SynthesisSettings | None = None,
    ) -> None:
        self.examples, self.choosers, self.rng = examples, choosers, rng
        self.settings = settings or SynthesisSettings()
        self._tracks = tuple(FighterTrack(examples.fps) for _ in examples.bodies)
        # the same for an action whenever it is performed
        self._strike_of, self._pace_of = cache(partial(strike_of, examples)), cache(partial(pace_of, examples))
        self.known_s: float | None = None
        self.astray: list[FloorMove | None] = [None for _ in examples.bodies]
        self.start = start = examples.start_frame(rng) if start is None else start
        for player, index in enumerate(examples.at(start)):
            self._begin(player, index, start)

    @property
    def fps(self) -> float:
        """Frames per second [1/s]."""
        return self.examples.fps

    @property
    def ends(self) -> tuple[int, ...]:
        """Frame at which the current action of each fighter ends and the next is due."""
        return tuple(track.current.action.end for track in self._tracks)

    @property
    def frame(self) -> int:
        """Frame of the next choice; everything before it is final (unless `interrupt`ed)."""
        return min(self.ends)

    @property
    def time(self) -> float:
        """Time of the next choice since the beginning [s]."""
        return self.frame / self.fps

    @property
    def due(self) -> int:
        """Fighter whose choice is next: 0 where both are due."""
        return int(np.argmin(self.ends))

    def current(self, player: int) -> FightAction:
        """What a fighter performs."""
        return self._tracks[player].current.action

    def during(self, player: int, frame: int) -> FightAction:
        """What a fighter performed at a frame."""
        return self._tracks[player].during(frame).action

    def pose(self, player: int, frame: int) -> FloatArray:
        """Pose (nq,) of a fighter at a frame up to the end of its current action."""
        return np.array(self._tracks[player].qpos[frame])

    def situation(self, player: int) -> Situation:
        """What a fighter would see if it had to choose at the end of its current action.

        Raises:
            SettingError: the other fighter must choose first.
        """
        end = self.ends[player]
        own, other = self._tracks[player], self._tracks[1 - player]
        if end > other.current.action.end:
            raise SettingError(
                f"fighter {player} acts until frame {end}, the other until {other.current.action.end}: step first"
            )
        last = own.current
        # of two who end together neither knows what the other is about to choose
        seen = other.during(end - 1)
        frame = floor_frame(own.com[end], other.com[end])
        return Situation(
            player=player,
            time=end / self.fps,
            own_label=last.action.label,
            opponent_label=seen.action.label,
            own=action_parameters(last.summary, frame),
            opponent=action_parameters(seen.summary, frame, opponent=True),
            frame=frame,
            example=last.action.example,
            position=own.qpos[end, :2].copy(),
            heading=float(yaw(own.qpos[end, 3:7])),
            known_s=self.known_s,
        )

    def step(self) -> FightAction:
        """Let the fighter whose action ends first choose and begin its next one, which is returned.

        Raises:
            SettingError: the chooser named an action that there is not, or the other fighter's.
        """
        player = self.due
        situation = self.situation(player)
        choice = self.choosers[player].choose(situation, self.rng)
        actions = self.examples.actions
        if not 0 <= choice.example < len(actions) or (
            self.examples.bodies[player] != self.examples.bodies[int(actions.player[choice.example])]
        ):
            raise SettingError(
                f"fighter {player} chose action {choice.example}; valid: 0 to {len(actions) - 1}, of an equal body"
            )
        self._perform(player, choice, situation)
        return self.current(player)

    def interrupt(self, player: int, frame: int) -> None:
        """End a fighter's current action early, at a frame before its end, after the beginning of both current actions.

        Raises:
            SettingError: another frame.
        """
        first = max(track.current.action.start for track in self._tracks)
        track = self._tracks[player]
        last = track.current
        if not max(first + 1, last.action.start + 2) <= frame < last.action.end:
            raise SettingError(
                f"fighter {player} cannot be interrupted at frame {frame}; valid: "
                f"{max(first + 1, last.action.start + 2)} to {last.action.end - 1}"
            )
        track.end_at(frame)

    def cut(self, player: int, frame: int) -> None:
        """Forget what a fighter was going to do from a frame on, also actions that have been chosen but not begun.

        Raises:
            SettingError: a frame outside what was drawn, or among the first two.
        """
        track = self._tracks[player]
        if not 2 <= frame <= track.current.action.end:
            raise SettingError(f"fighter {player} cut at frame {frame}; valid: 2 to {track.current.action.end}")
        while len(track.done) > 1 and track.current.action.start > frame - 2:
            track.done.pop()
        track.end_at(frame)

    def move(self, player: int, gradual: GradualMove) -> None:
        """Move what a fighter is going to do on the floor, such as to where its body really is."""
        self._tracks[player].move(gradual)

    def moving(self, player: int, frame: float) -> FloorMove | None:
        """What is still to come at a frame of a fighter's moves; None for nothing."""
        return self._tracks[player].moving(frame)

    def unmoved(self, player: int, frames: int) -> FloatArray:
        """A fighter's first poses (F, nq) as they would be without any `move`."""
        return self._tracks[player].unmoved(frames)

    def fill(self, player: int, qpos: FloatArray, contacts: BoolArray, note: str) -> None:
        """Let a fighter do something that was not chosen, where its last action ends, such as lie or wait.

        Args:
            player: 0 or 1.
            qpos: (F + 2, nq) poses, of which the last two belong to what follows.
            contacts: (F + 2, 2) feet that stand.
            note: what it is (`FightAction`).
        """
        track, begin = self._tracks[player], self.ends[player]
        kinematics = forward_kinematics(qpos, self.examples.bodies[player])
        track.put(begin, qpos, contacts, kinematics, self._reduced(qpos, kinematics))
        # in the eyes of the model both stand in guard, as they did when the fight began
        action = FightAction(player, begin, begin + len(qpos) - CONTEXT, track.done[0].action.label, note=note)
        track.perform(action, NONE)

    def drawn(self, player: int, first: int) -> tuple[FloatArray, BoolArray]:
        """Poses (F, nq) and standing feet (F, 2) from a frame to the end of what was drawn, two frames of what follows included."""
        track = self._tracks[player]
        after = track.current.action.end + CONTEXT
        return track.qpos[first:after].copy(), track.contacts[first:after].copy()

    @property
    def actions(self) -> tuple[FightAction, ...]:
        """Everything drawn so far, fighter by fighter."""
        return tuple(one.action for track in self._tracks for one in track.done)

    def run(self, frames: int) -> None:
        """Step until both fighters have at least so many frames."""
        while self.frame < frames:
            self.step()

    def fight(self, frames: int | None = None, mode: str = "automatic", seed: int = 0, name: str = "fight") -> Fight:
        """The fight's first frames; None: up to the next choice. Other arguments as of `Fight`.

        Raises:
            SettingError: more frames than there are.
        """
        frames = self.frame if frames is None else frames
        if not 2 <= frames <= self.frame:
            raise SettingError(f"{frames} frames; valid: 2 to {self.frame}")
        motions, actions = [], []
        for player, (track, body) in enumerate(zip(self._tracks, self.examples.bodies)):
            motions.append(
                Motion(
                    track.qpos[:frames],
                    self.fps,
                    track.contacts[:frames],
                    name=f"{name}_{player_name(player)}",
                    source="synthesised from recorded actions",
                    character=body,
                )
            )
            for one in track.done:
                if one.action.start < frames:
                    moment = one.action.moment if one.action.moment < frames else NONE
                    actions.append(replace(one.action, end=min(one.action.end, frames), moment=moment))
        return Fight(DuelStream(tuple(motions), name=name), tuple(actions), mode, seed)

    def _begin(self, player: int, index: int, start: int) -> None:
        """The rest of a recorded action, where it was recorded."""
        examples = self.examples
        gone = start - int(examples.actions.start[index])
        length = int(examples.actions.end[index]) - start
        found = examples.excerpt(index, np.arange(gone, gone + length + CONTEXT, dtype=np.float64))
        track = self._tracks[player]
        made = plant(found.qpos, found.contacts, found.turning, self.fps, examples.bodies[player])
        track.put(0, made.qpos, made.contacts, made.kinematics, self._reduced(made.qpos, made.kinematics))
        moment = int(examples.moments[index]) - start
        action = FightAction(
            player, 0, length, int(examples.actions.label[index]), self._known(index), moment if moment >= 0 else NONE
        )
        # the fighters know what was recorded before the fight begins
        track.done.append(Performed(action, index, examples.summaries[index]))

    def _perform(self, player: int, choice: Choice, situation: Situation) -> None:
        examples, settings = self.examples, self.settings
        index, track = choice.example, self._tracks[player]
        begin = track.current.action.end
        pace, start = self._pace_of(index, settings.pace), int(examples.actions.start[index])
        own_moment = pace.at(int(examples.moments[index]) - start)
        warp = self._warp(player, index, begin, own_moment)
        length = warp.length(pace.at(int(examples.actions.end[index]) - start))
        times = pace.source(warp.source(np.arange(length + CONTEXT, dtype=np.float64)))
        # one frame before the action, for the velocity with which it begins
        found = examples.excerpt(index, np.append(times[0] - (times[1] - times[0]), times))
        source, contacts = found.qpos[1:], found.contacts[1:]
        assert situation.position is not None
        assert situation.heading is not None
        aim = None if choice.goal is None else Aim(choice.goal, round(choice.goal_s * self.fps))
        heading = float(yaw(source[0, 3:7]))
        example_frame = FloorFrame(examples.frames.origin[index], examples.frames.toward[index])
        placed = partial(
            place, source[:, :2], heading, example_frame, situation.position, situation.heading, situation.frame, length,
            longest=settings.longest_drift_m,
        )  # fmt: skip
        most = settings.acceleration / self.fps**2
        placement = placed(aim=aim, most=most if aim is None else np.inf)
        strike = self._strike_of(index) if settings.reach_m and aim is None else None
        if strike is not None:
            when = min(int(np.argmin(np.abs(times[:length] - strike.frame))), length - 1)
            other = self._tracks[1 - player]
            there = other.qpos[min(begin + when, len(other.qpos) - 1)]
            off = self.astray[1 - player]
            there = there if off is None else off.poses(there[None], np.ones(1))[0]
            aim = bent(strike, placement, when, there, examples.bodies[1 - player], settings.reach_m)
            placement = placed(aim=aim, most=most)
        before = found.qpos[0].copy()
        before[:2] = situation.position + turned(found.qpos[0, :2] - source[0, :2], placement.turn[0])
        before[3:7] = multiply_quat(about_vertical(placement.turn[:1])[0], before[3:7])
        seam = Seam(track.qpos[begin - 1 : begin + 2].copy(), track.contacts[begin].copy(), track.lift[begin].copy())
        made = stitch(
            seam, placement.poses(source), before, contacts, found.turning[1:], length, self.fps, examples.bodies[player],
            settings.stitch,
        )  # fmt: skip
        track.put(begin, made.qpos, made.contacts, made.kinematics, self._reduced(made.qpos, made.kinematics))
        action = FightAction(
            player,
            begin,
            begin + length,
            int(examples.actions.label[index]),
            self._known(index),
            begin + min(round(own_moment + warp.wanted - warp.moment), length - 1),
            choice.request,
            choice.note,
        )
        track.perform(action, index)

    def _warp(self, player: int, index: int, begin: int, own_moment: float) -> Warp:
        """Time warp that lets the moments coincide, where there is an attack and it is possible."""
        other = self._tracks[1 - player].during(begin)
        ahead = other.action.moment - begin
        if self.settings.warp is None or ahead < 1:
            return Warp()
        attacked = other.index != NONE and self.examples.attacks[other.index]
        if not (self.examples.attacks[index] or attacked):
            return Warp()
        return fit_warp(own_moment, ahead, self.settings.warp) or Warp()

    def _known(self, index: int) -> int:
        return index if index < self.examples.known else NONE

    def _reduced(self, qpos: FloatArray, kinematics: Kinematics) -> FloatArray:
        """(F, k) reduced poses."""
        return self.examples.basis.project(local_joints(kinematics, yaw(qpos[:, 3:7])))


def synthesise(
    examples: ExampleMotions,
    choosers: tuple[Chooser, ...],
    seconds: float,
    rng: np.random.Generator,
    start: int | None = None,
    settings: SynthesisSettings | None = None,
    mode: str = "automatic",
    seed: int = 0,
) -> Fight:
    """A fight of a given length [s]; `seed` is that of `rng`, for the record, other arguments as of `Bout` and `Fight`.

    Raises:
        SettingError: a length that is not positive.
    """
    if not seconds > 0:
        raise SettingError(f"a fight of {seconds} s; valid: above 0")
    bout = Bout(examples, choosers, rng, start, settings)
    frames = max(2, round(seconds * examples.fps))
    bout.run(frames)
    return bout.fight(frames, mode, seed)
