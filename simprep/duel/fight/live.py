"""A fight that is simulated while it is drawn: what the bodies do decides what comes next.

    made = begin_fight(model, "automatic", seed=1)
    live = LiveFight(made, seed=1)
    live.run(10.0)
    result = live.result()

Before every choice, what a fighter is still going to do is moved on the floor, little by little, to where the body is:
so the next action is chosen and placed by where both bodies are, and the tracker is told anew what to follow. Feet in
contact decide where a body is (`floor_move.move_between`). Who is out of balance breaks off. Who falls lies, gets up, and the fight goes on.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from time import perf_counter

import numpy as np

from simprep.arrays import FloatArray
from simprep.duel.fight.balance import BalanceWatch
from simprep.duel.fight.falls import BLOW_NS, Blow, Fall, blow_before, blows, collision_before
from simprep.duel.fight.fight import Fight
from simprep.duel.fight.floor_move import FloorMove, GradualMove, move_between
from simprep.duel.fight.hits import judge_actions
from simprep.duel.fight.modes import FightInMode
from simprep.duel.fight.pace import PaceSettings
from simprep.duel.fight.passive import ReactingChooser, RecordedChooser, StruckChooser
from simprep.duel.fight.posture import posture_of_piece, punching_at
from simprep.duel.fight.recovery import Recovery
from simprep.duel.fight.synthesis import CONTEXT
from simprep.duel.stream.stream import DuelStream, player_name
from simprep.motion.edit import sample
from simprep.motion.motion import Motion
from simprep.physics.run import Run
from simprep.physics.tracker import Tracker
from simprep.physics.tracker_state import TrackerState

HISTORY_S = 0.25
"""Postures are optimised from so long before a new action on, so that they go on smoothly [s]."""
REACTS, CATCHES, DOWN, WAITS = "reacts", "catches", "down", "waits"
"""Notes of actions (`FightAction.note`)."""


@dataclass(frozen=True)
class LiveSettings:
    """How a fight follows its bodies.

    Attributes:
        ahead_s: an action is chosen so long before it begins: a little more than controllers look ahead [s].
        carry_s: longest time in which what is to come is moved to where the body is [s].
        speed: largest speed of that move [m/s].
        spin: largest angular velocity of it [rad/s].
        acceleration: largest one of it, and of the drifts of actions, but for those that a user asks for [m/s^2]. The default
            brings a COM at 0.9 m away from one end of a fighting stance of 0.7 m (g 0.35 / 0.9).
        dead_m: bodies this near to their references are left alone [m].
        dead_rad: and turned by less than this [rad].
        reach_m: how far an attacker is drawn at most for a strike to meet its target [m]; 0: not.
        pace: how fast the feet of an action may go; None: as fast as in its example.
        react_s: who is struck ends the own action so long after the blow [s]; 0: nobody reacts.
        off_m: so does who is so far out of balance (`balance.BalanceWatch`) [m]; 0: nobody.
        tries: attempts to roll over or get up before a fighter stays down.
    """

    ahead_s: float = 0.6
    carry_s: float = 0.5
    speed: float = 0.5
    spin: float = 1.2
    acceleration: float = 3.8
    dead_m: float = 0.1
    dead_rad: float = 0.15
    reach_m: float = 0.3
    pace: PaceSettings | None = field(default_factory=PaceSettings)
    react_s: float = 0.12
    off_m: float = 0.35
    tries: int = 6


@dataclass(frozen=True)
class LiveResult:
    """What came of a fight.

    Attributes:
        fight: what was drawn, moved to where the bodies were.
        tracked: the same with its postures optimised where that was wished: what the bodies were told to follow.
        resting: what was drawn, without the moves: feet that stand rest in it, so slips are compared with it.
        run: the whole simulation.
        falls: in order of time.
    """

    fight: Fight
    tracked: Fight
    resting: DuelStream
    run: Run
    falls: tuple[Fall, ...]


class LiveFight:
    """A fight and the simulation of its bodies, in step.

    Args:
        made: the fight, not stepped yet.
        seed: of the controller.
        tracker: of both bodies, nothing given to it yet; None: `mpc` with the preset.
        preset: of `mpc`.
        optimise: optimise postures before they are tracked.
        settings: None for the defaults.

    Attributes:
        made: the fight, as it is drawn.
        bout: its actions.
        tracker: the simulation.
        optimised: whether postures are optimised.
        wall_s: computing time so far, everything included [s].
        drawing_s: the part of it that went into choosing and making actions [s].
    """

    def __init__(
        self,
        made: FightInMode,
        seed: int = 0,
        tracker: Tracker | None = None,
        preset: str = "default",
        optimise: bool = False,
        settings: LiveSettings | None = None,
    ) -> None:
        self.made, self.bout, self.settings = made, made.bout, settings or LiveSettings()
        self.tracker = tracker or Tracker(self.bout.examples.bodies, preset, seed)
        self.optimised = optimise
        self.wall_s = self.drawing_s = 0.0
        self._players = range(len(self.bout.examples.bodies))
        self._poses: list[FloatArray] = [np.empty((0, 0)) for _ in self._players]  # what bodies follow, frame by frame
        self._begun, self._step = False, 0
        self._blows: tuple[Blow, ...] = ()
        self._answered: set[tuple[int, int]] = set()
        self._balance = [BalanceWatch(body, self.bout.fps) for body in self.bout.examples.bodies]
        self._catching: set[int] = set()  # out of balance, and have not chosen yet what to do about it
        self._calm_s = [0.0 for _ in self._players]  # until when nobody breaks off again
        self._pause: int | None = None
        self._waiting: tuple[list[FloatArray], ...] = tuple([] for _ in self._players)
        self._recovery = Recovery(self.bout.examples.bodies, self.bout.fps, self.settings.tries)
        s = self.settings
        self.bout.settings = replace(self.bout.settings, reach_m=s.reach_m, pace=s.pace, acceleration=s.acceleration)
        self._struck: list[StruckChooser | None] = [None for _ in self._players]
        choosers = list(self.bout.choosers)
        for player, own in enumerate(choosers):
            if self.settings.react_s and not isinstance(own, RecordedChooser):
                reacting = ReactingChooser(made.model.model.players[player])
                self._struck[player] = choosers[player] = StruckChooser(own, reacting)
        self.bout.choosers = tuple(choosers)

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self._step * self.tracker.timestep

    @property
    def falls(self) -> tuple[Fall, ...]:
        """So far, in order of time."""
        return self._recovery.falls

    def run(self, seconds: float, progress: Callable[[float], None] | None = None) -> None:
        """Go on until so many seconds are simulated, or the simulation diverges; `progress` is called with the share."""
        begin = perf_counter()
        last, fps = (round(seconds * self.bout.fps) - 1) / self.bout.fps, self.bout.fps
        steps = round(last / self.tracker.timestep)
        if not self._begun:
            self._begun = True
            for player in self._players:
                self._give(player, 0, 0)
        frame = int(self.time * fps + 1e-6)
        while self._step < steps and not self.tracker.end:
            while self._pause is None and self.bout.frame < (self.time + self.settings.ahead_s) * fps:
                self._draw()
            self.tracker.step()
            self._step += 1
            now = int(self.time * fps + 1e-6)
            if now > frame:
                frame = now
                self._watch(now)
                if progress is not None:
                    progress(self._step / steps)
        self.wall_s += perf_counter() - begin

    def result(self, name: str = "fight") -> LiveResult:
        """The fight so far.

        Raises:
            SettingError: nothing was simulated yet.
        """
        frames, pause = int(self.time * self.bout.fps + 1e-6) + 1, self._pause
        waiting = tuple(list(one) for one in self._waiting)
        if pause is not None:
            self._resume(frames)
        fight = self.made.fight(frames / self.bout.fps, name)
        motions = [
            replace(motion, qpos=self._poses[player][:frames].copy())
            for player, motion in enumerate(fight.stream.players)
        ]
        stream = replace(fight.stream, players=tuple(motions))
        still = [
            replace(one, qpos=self.bout.unmoved(player, frames)) for player, one in enumerate(fight.stream.players)
        ]
        resting = replace(fight.stream, players=tuple(still))
        if pause is not None:  # they still wait
            self._pause, self._waiting = pause, waiting
            for player in self._players:
                self.bout.cut(player, pause)
        return LiveResult(fight, replace(fight, stream=stream), resting, self.tracker.run(whole=True), self.falls)

    # ---- drawing -----------------------------------------------------------------------------------------------------

    def _draw(self) -> None:
        """The next action of whoever is due, from where both bodies are."""
        changed: dict[int, int] = {}
        if self._step:
            state = self.tracker.state
            for player in self._players:
                first = self._carry(player, state)
                if first is not None:
                    changed[player] = first
        self.bout.known_s, begin = self.time, perf_counter()
        begun = self.bout.step()
        if begun.player in self._catching:
            self._catching.discard(begun.player)
            first = self._carry(begun.player, self.tracker.state)
            if first is not None:
                changed[begun.player] = min(first, changed.get(begun.player, first))
        if self.made.alertness is not None:
            self.made.alertness.watch(self.bout, begun)
        self.drawing_s += perf_counter() - begin
        changed[begun.player] = min(begun.start, changed.get(begun.player, begun.start))
        for player, first in changed.items():
            self._give(player, first, begun.start if player == begun.player else None)

    def _carry(self, player: int, state: TrackerState) -> int | None:
        """Move what a fighter is going to do to where its body is; the first frame that changes, None for none."""
        move = self.offset(player, state)
        self.bout.astray[player] = None
        first = int(self.time * self.bout.fps) + 2
        end = self.bout.ends[player]
        frames = min(round(self.settings.carry_s * self.bout.fps), end - first)
        if frames < 2 or player in state.fallen:
            return None
        s, whole = self.settings, move
        move = whole.beyond(s.dead_m, s.dead_rad).within(frames / self.bout.fps, s.speed, s.spin, s.acceleration)
        self.bout.astray[player] = FloorMove(whole.shift - move.shift, whole.turn - move.turn, whole.pivot)
        if not (move.size_m or move.turn):
            return None
        gradual = GradualMove(move, first, frames)
        self.bout.move(player, gradual)
        poses = self._poses[player]
        share = gradual.share(np.arange(first, len(poses)))
        poses[first:] = move.poses(poses[first:], share)
        return first

    def offset(self, player: int, state: TrackerState) -> FloorMove:
        """Where a body is against what is drawn, less what that is going to be moved anyway."""
        frame = self.time * self.bout.fps
        _, standing = self.bout.drawn(player, int(frame))
        body = self.bout.examples.bodies[player]
        move = move_between(state.reference_qpos[player], state.bodies_qpos[player], standing[0], body)
        coming = self.bout.moving(player, frame)
        if coming is None:
            return move
        return FloorMove(move.shift - coming.shift, move.turn - coming.turn, move.pivot)

    def _give(self, player: int, first: int, new: int | None) -> None:
        """Tell the tracker what to follow from a frame on; from frame `new` on it has been drawn just now."""
        if new is not None:
            qpos, contacts = self.bout.drawn(player, new)
            if self.optimised:
                qpos = self._better(player, new)
            self._poses[player] = np.concatenate([self._poses[player][:new], qpos]) if new else qpos
        _, contacts = self.bout.drawn(player, first)
        qpos = self._poses[player][first:][: len(contacts) - CONTEXT + 1]
        fps, body = self.bout.fps, self.bout.examples.bodies[player]
        whole = Motion(qpos, fps, contacts[: len(qpos)], name=f"fight_{player_name(player)}", character=body)
        self._follow(player, whole, first / fps)

    def _better(self, player: int, first: int) -> FloatArray:
        """What was drawn from a frame on, its posture optimised."""
        begin = max(0, first - round(HISTORY_S * self.bout.fps))
        qpos, contacts = self.bout.drawn(player, begin)
        motion = Motion(qpos, self.bout.fps, contacts, character=self.bout.examples.bodies[player])
        own = [one for one in self.bout.actions if one.player == player]
        weight = punching_at(np.arange(begin, begin + len(qpos)), own, self.bout.fps)
        return posture_of_piece(motion, weight, first - begin)

    def _follow(self, player: int, motion: Motion, since_s: float, anew: bool = False) -> None:
        """Let a body follow a motion from a time on, at the simulation's own steps."""
        step = self.tracker.timestep
        first = round(since_s / step)
        steps = np.arange(first, round((since_s + motion.duration) / step) + 1, dtype=np.float64)
        times = steps * step - since_s
        nearest = np.clip(np.round(times * motion.fps).astype(int), 0, len(motion) - 1)
        exact = replace(
            motion, qpos=sample(motion, times), fps=1 / step, contacts=motion.contacts[nearest], events={}, loop=False
        )
        each: list[Motion | None] = [None for _ in self._players]
        each[player] = exact
        if first == 0:
            self.tracker.extend(*each)
        else:
            self.tracker.extend(*each, since_s=first * step, anew=anew)

    # ---- consequences ------------------------------------------------------------------------------------------------

    def _watch(self, frame: int) -> None:
        """Once for each frame: blows, falls, and getting up."""
        state = self.tracker.state
        self._feel()
        for player, words in self.tracker.fall_reasons().items():
            if not self._recovery.is_down(player):
                near = blow_before(self._blows, player, self.time)
                collision = collision_before(self.tracker.contacts(self.time - 1.5), player, self.time)
                self._recovery.fell(Fall(player, self.time, words, near, collision))
                self._halt(frame)
        if self._pause is None:
            self._keep_balance(frame, state)
            return
        for player in self._players:
            motion = self._recovery.next_motion(player, self.time, state)
            if motion is not None:
                self._follow(player, motion, self.time, anew=True)
            self._waiting[player].append(state.reference_qpos[player])
        if not self._recovery.anybody_down:
            self._resume(frame + 1)

    def _feel(self) -> None:
        """Note the blows of late, and let who is struck react."""
        now = self.time
        if not self.tracker.contacts(now - 1.5 / self.bout.fps):
            return
        judged = judge_actions(
            self.tracker.contacts(max(0.0, now - 1.5)), self.bout.actions, self.bout.examples.bodies, self.bout.fps
        )
        self._blows = blows(judged)
        actions = self.bout.actions
        for blow in self._blows:
            key = blow.player, actions[blow.attack].start
            if blow.impulse_ns >= BLOW_NS and key not in self._answered:
                self._answered.add(key)
                self._react(blow.player)

    def _keep_balance(self, frame: int, state: TrackerState) -> None:
        """Who is out of balance on the ground breaks off what he does, and catches himself."""
        for player in self._players:
            standing = self.bout.drawn(player, frame)[1][0]
            poses = state.bodies_qpos[player], state.reference_qpos[player]
            off = self._balance[player].error_m(*poses, standing) > self.settings.off_m > 0
            if off and standing.any() and self.time >= self._calm_s[player] and self._react(player, CATCHES):
                self._catching.add(player)
                self._calm_s[player] = self.time + self.settings.carry_s

    def _react(self, player: int, note: str = REACTS) -> bool:
        """Let a fighter break off and choose among reactions; whether that is possible."""
        chooser = self._struck[player]
        frame = int(np.ceil((self.time + self.settings.react_s) * self.bout.fps))
        current = self.bout.current(player)
        if chooser is None or self._pause is not None or current.request or not 2 < frame < current.end:
            return False
        self.bout.cut(player, frame)
        chooser.struck = note
        return True

    def _halt(self, frame: int) -> None:
        """Who is up waits for who is down."""
        if self._pause is None:
            self._pause = frame
            for player in self._players:
                self.bout.cut(player, frame)

    def _resume(self, frame: int) -> None:
        """Go on with the fight, drawn anew from where both are."""
        assert self._pause is not None
        ahead = round(self.settings.ahead_s * self.bout.fps) + 1
        for player, waiting in enumerate(self._waiting):
            missing = frame - self._pause - len(waiting) + ahead + CONTEXT
            last = waiting[-1] if waiting else self._poses[player][self._pause]
            poses = np.array([*waiting, *[last] * missing])
            down = any(
                one.player == player and (one.up_s is None or one.up_s * self.bout.fps > self._pause)
                for one in self.falls
            )
            self.bout.fill(player, poses, np.full((len(poses), 2), not down), DOWN if down else WAITS)
            self._poses[player] = np.concatenate([self._poses[player][: self._pause], poses])
            waiting.clear()
        self._pause = None
