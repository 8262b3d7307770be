"""The simulation, step by step: bodies follow motions that may still be growing, and stand where these end.

    tracker = Tracker(humanoid(), preset="live", seed=1)
    tracker.extend(walk)
    for _ in range(480):
        tracker.step()
    tracker.extend(punch)  # goes on where the walk ends
    print(tracker.state.qpos, tracker.ahead_s)
    run = tracker.run()

`simprep.track` and `simprep.simulate` are loops over this.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from time import perf_counter

import mujoco
import numpy as np

from simprep.arrays import FloatArray
from simprep.character import Character
from simprep.errors import SettingError, UnknownNameError
from simprep.humanoid_model import humanoid
from simprep.motion.motion import Motion
from simprep.physics.bodies import SceneBody, scene_bodies
from simprep.physics.contacts import BodyContact, ContactReader, merge_touches
from simprep.physics.controller import Controller, ControllerFactory, ControlTask
from simprep.physics.falls import divergence, fall
from simprep.physics.mismatch import Mismatch, Observer
from simprep.physics.mpc_settings import MPC_PRESETS
from simprep.physics.named_controllers import controller_factory
from simprep.physics.overlap import overlap_of_poses
from simprep.physics.pushes import Push, PushApplier
from simprep.physics.recorder import BodyRecorder
from simprep.physics.reference import Reference
from simprep.physics.reference_line import PastReference, ReferenceLine
from simprep.physics.run import DIVERGED, DONE, FELL, Assist, BodyRun, Run
from simprep.physics.settings import SimulationSettings
from simprep.physics.speed_guard import SpeedGuard
from simprep.physics.tracker_state import TrackerState
from simprep.random_seed import checked_seed
from simprep.scene import build_scene

ASK_S = 1.0
"""A function that gives motions is asked when less than this is left [s]."""
AHEAD_S, LEAST_AHEAD_S, BEHIND_S = 5.0, 0.75, 0.75
"""How far ahead a growing reference is worked out, when again, and how much of the past it keeps [s]."""
STANDING_AHEAD_S = 1.25
"""How far ahead standing is worked out where nothing else is known [s]."""
_ALIGNED = 48  # windows begin at multiples of so many steps, on which all slower rates fall

Source = Callable[[TrackerState | None], Motion | Sequence[Motion | None] | None]
"""What gives the next motions when they are needed, or None where there are none (yet). It is told the state, or None before
the first step."""


class Tracker:
    """Bodies in one simulated world that track motions with joint motors only.

    Args:
        characters: one body, or several that collide with each other.
        preset: `live`, `default` or `bake` (see `MPC_PRESETS`); None for `settings.mpc`.
        seed: of the controller's random generator.
        controller: `mpc`, `balance`, `pd` or your own (`simprep.physics.controller`).
        settings: scene, reference processing, disturbances.
        stands: where a motion ends, its body brakes and stands, and falls end nothing; otherwise the first end of a
            motion and the first fall end the simulation.
        records: keep what happens, for `run`; without it, memory does not grow.

    Attributes:
        model: the simulated world; it may be changed before the first step.

    Raises:
        UnknownNameError: no such preset or controller.
        SettingError: no body or too many, something that is no body or no controller, or no seed.
    """

    def __init__(
        self,
        characters: Character | Sequence[Character] = humanoid(),
        preset: str | None = "default",
        seed: int = 0,
        controller: str | ControllerFactory = "mpc",
        settings: SimulationSettings | None = None,
        stands: bool = True,
        records: bool = True,
    ) -> None:
        settings = settings or SimulationSettings()
        if preset is not None:
            if preset not in MPC_PRESETS:
                raise UnknownNameError("preset", preset, tuple(MPC_PRESETS))
            settings = replace(settings, mpc=MPC_PRESETS[preset])
        self._factory = controller_factory(controller, settings.mpc)
        bodies = tuple(characters) if isinstance(characters, Sequence) else (characters,)
        for one in bodies:
            if not isinstance(one, Character):
                raise SettingError(f"{one!r} is no body; valid: a Character, as of simprep.humanoid(), or several")
        self._settings, self._seed, self._stands, self._records = settings, checked_seed(seed), stands, records
        self._scene = replace(settings.scene, bodies=bodies)
        self.model = settings.mismatch.world(self._scene)
        self._known = self.model if settings.mismatch == Mismatch() else build_scene(self._scene)
        self._bodies = scene_bodies(self.model, bodies)
        self._guard = SpeedGuard(self.model, self._bodies)
        self._timestep = float(self.model.opt.timestep)
        self._lines = [ReferenceLine(one, self._timestep, settings.reference) for one in bodies]
        self._data = mujoco.MjData(self.model)
        self._observer = Observer(self._known, self._bodies, settings.mismatch, np.random.default_rng([self._seed, 1]))
        self._push = PushApplier(self.model, settings.pushes, self._bodies, settings.kicks)
        self._between = ContactReader(self.model, self._bodies)
        self._brain: Controller | None = None
        self._recorders: tuple[BodyRecorder, ...] = ()
        self._references: tuple[Reference, ...] = ()
        self._past = [PastReference() for _ in bodies]
        self._source: Source | None = None
        self._stale = False
        self._step = self._first = 0  # the present step, and that of the references' first pose
        self._fallen: tuple[int, ...] = ()
        self._falls: dict[int, str] = {}
        self._ending: tuple[str, str, int, int | None] | None = None  # end, reason, steps, who fell
        self._stopped = False
        self._wall_s = self._simulation_s = 0.0

    @property
    def timestep(self) -> float:
        """Duration of a step [s]."""
        return self._timestep

    @property
    def data(self) -> mujoco.MjData:
        """The simulated world after the last step, to read; things that are no bodies may be moved."""
        return self._data

    @property
    def bodies(self) -> tuple[SceneBody, ...]:
        """Where each body's quantities are in `model` and `data`."""
        return self._bodies

    @property
    def end(self) -> str:
        """`done`, `fell` or `diverged` where it does not go on, else empty."""
        return self._ending[0] if self._stopped and self._ending else ""

    @property
    def ahead_s(self) -> float:
        """How much is left of what was given, for the body that has the least [s]."""
        return max(0, min(line.last for line in self._lines) - self._step) * self._timestep

    @property
    def state(self) -> TrackerState:
        """Where the bodies are now.

        Raises:
            SettingError: there is no motion yet.
        """
        if self._brain is None:
            self._prepare()
        return self._state()

    def _state(self) -> TrackerState:
        now = self._step - self._first
        return TrackerState(
            time=self._step * self._timestep,
            bodies_qpos=tuple(self._data.qpos[body.qpos].copy() for body in self._bodies),
            bodies_qvel=tuple(self._data.qvel[body.qvel].copy() for body in self._bodies),
            reference_qpos=tuple(reference.qpos[now].copy() for reference in self._references),
            ahead_s=tuple(max(0, line.last - self._step) * self._timestep for line in self._lines),
            fallen=self._fallen,
            end=self.end,
        )

    def extend(self, *motions: Motion | Source | None, since_s: float | None = None, anew: bool = False) -> None:
        """Go on with motions, where the reference of each body ends, or from now on where it has ended already.

        A motion is not moved: it has to begin within `reference_line.GAP_M` of where the reference is, and what is left
        of the difference dies away.

        Args:
            motions: one for each body; None for a body that gets none. Or one function that gives them whenever less
                than a second is left: it takes the state, and returns a motion, one for each body, or None.
            since_s: time of the motions' first poses, now or later [s]: what was given from then on is forgotten. None:
                they follow what was given.
            anew: the bodies have lost their references: the motions may begin anywhere, now or at `since_s`.

        Raises:
            MotionError: a motion of another body, of one frame, or one that begins too far away.
            SettingError: not one for each body, a time that is past, or a function with a time.
        """
        now = self._step * self._timestep
        if since_s is not None and not now - self._timestep / 2 <= since_s < np.inf:
            raise SettingError(f"motions since {since_s:g} s; valid: now, {now:g} s, or later")
        since = self._step if since_s is None else round(since_s / self._timestep)
        if len(motions) == 1 and callable(motions[0]) and not isinstance(motions[0], Motion):
            if since_s is not None or anew:
                raise SettingError("a function gives motions when they are needed; valid: without since_s and anew")
            self._source = motions[0]
            return
        if len(motions) != len(self._lines):
            raise SettingError(f"{len(motions)} motions; valid: {len(self._lines)}, one for each body or None")
        for motion in motions:
            if not (motion is None or isinstance(motion, Motion)):
                raise SettingError(f"{motion!r} is no motion")
        for line, motion in zip(self._lines, motions):
            if isinstance(motion, Motion):
                if anew and line.last >= 0:
                    line.begin_anew(motion, since)
                else:
                    if since_s is not None:
                        line.forget(since)
                    line.extend(motion, since)
                self._stale = True

    def fall_reasons(self) -> dict[int, str]:
        """Who is down, and the rule by which, in words."""
        return dict(self._falls)

    def contacts(self, since_s: float = 0.0) -> tuple[BodyContact, ...]:
        """Contacts between the bodies so far, of touches from a time on [s]; none where nothing is recorded."""
        first = round(since_s / self._timestep)
        touches = self._between.touches
        return merge_touches(touches[bisect_left(touches, first, key=lambda one: one.step) :], self._timestep)

    def push(self, push: Push) -> None:
        """Push while it goes on; `Push.start` counts from the first step. SettingError for an unknown segment, or no `Push`."""
        if not isinstance(push, Push):
            raise SettingError(f"{push!r} is no push; valid: a simprep.Push")
        self._push.add(push)

    def step(self) -> None:
        """Simulate one step.

        Raises:
            SettingError: there is no motion, or the simulation has ended.
        """
        begin = perf_counter()
        if self._stopped:
            raise SettingError(f"the simulation has ended: {self.end}")
        with quiet_warnings():
            self._prepare()
            self._advance()
        self._wall_s += perf_counter() - begin

    def run(self, whole: bool = False) -> Run:
        """What has been simulated, up to the first fall.

        Args:
            whole: what came after the first fall too; such a run is `done`, unless it diverged.

        Raises:
            SettingError: nothing yet, or a tracker that does not record.
        """
        if not self._records:
            raise SettingError("this tracker keeps no record; valid: Tracker(records=True)")
        if self._brain is None or not (self._step or self._ending):
            raise SettingError("nothing was simulated yet; give a motion and step")
        so_far = (DONE, "as far as it was simulated", self._step, None)
        end, reason, taken, fallen = so_far if whole and self.end != DIVERGED else self._ending or so_far
        bodies, poses = [], []
        for number, (reference, recorder) in enumerate(zip(self._references, self._recorders)):
            motion, qvel = self._past[number].joined(reference, self._first)
            poses.append(motion.qpos[:taken])
            bodies.append(
                BodyRun(
                    reference=motion,
                    reference_qvel=qvel[: taken + 1],
                    torque_limit=self.model.actuator_forcerange[recorder.body.controls, 1].copy(),
                    processing=reference.processing,
                    **recorder.arrays(taken),
                )
            )
        settings = self._brain.settings()
        if self._settings.mismatch != Mismatch():
            settings["mismatch"] = self._settings.mismatch.record()
        simulation_s = self._simulation_s + getattr(self._brain, "simulation_s", 0.0)
        return Run(
            bodies=tuple(bodies),
            controller=self._brain.name,
            seed=self._seed,
            timestep=self._timestep,
            end=end,
            end_reason=reason,
            fallen=fallen,
            contacts=merge_touches([one for one in self._between.touches if one.step < taken], self._timestep),
            overlap=np.array(self._between.overlap[:taken]),
            reference_overlap=overlap_of_poses(poses, self._scene.bodies),
            unconverged=np.array(self._between.unconverged[:taken], dtype=bool),
            settings=settings,
            assist=Assist(self._push.largest, 0.0, self._push.kick_mps, self._push.kick_radps),
            wall_s=self._wall_s,
            overhead_share=max(0.0, 1 - simulation_s / self._wall_s),
        )

    def _prepare(self) -> None:
        """Bring the references up to date."""
        if self._source is not None and self.ahead_s < ASK_S:
            more = self._source(None if self._brain is None else self._state())
            if more is not None:
                self.extend(*(more if isinstance(more, Sequence) else (more,)))
        if any(line.last < 0 for line in self._lines):
            raise SettingError("there is no motion to track yet; extend the tracker by one for each body")
        given = [line.last for line in self._lines]
        last = min(given)
        if self._stands:
            seconds = 1 / self._timestep
            worked_out = self._first + len(self._references[0].qpos) - 1 if self._references else -1
            self._stale |= worked_out - self._step < LEAST_AHEAD_S * seconds
            last = min(max(given), self._step + round(AHEAD_S * seconds))
            last = max(last, self._step + round(STANDING_AHEAD_S * seconds))
        if self._stale:
            self._follow(last)

    def _follow(self, last: int) -> None:
        """Work out the references from a while ago to step `last`."""
        self._stale = False
        first = 0
        if self._brain is not None:
            first = max(0, (self._step - round(BEHIND_S / self._timestep)) // _ALIGNED * _ALIGNED)
        references = tuple(line.window(first, last) for line in self._lines)
        if self._brain is None:
            self._begin(references)
        elif not hasattr(self._brain, "follow"):
            raise SettingError(f"controller {self._brain.name!r} cannot track a growing reference: it has no `follow`")
        else:
            for past, reference in zip(self._past, self._references) if self._records else ():
                past.keep(reference, self._first, self._step)
            self._brain.follow(references, self._first - first)
        self._first, self._references = first, references

    def _begin(self, references: tuple[Reference, ...]) -> None:
        data = self._data
        for body, reference in zip(self._bodies, references, strict=True):
            data.qpos[body.qpos], data.qvel[body.qvel] = reference.qpos[0], reference.qvel[0]
        mujoco.mj_forward(self.model, data)
        task = ControlTask(self._known, self._scene, self._bodies, references, self._seed, self._observer.delay)
        self._brain = self._factory(task)
        if hasattr(self._brain, "start"):
            data.qvel[:] = self._brain.start(data)
            mujoco.mj_forward(self.model, data)
        steps = len(references[0].qpos) - 1
        self._recorders = tuple(BodyRecorder(steps, self.model, body) for body in self._bodies)
        for recorder in self._recorders:
            recorder.state(0, data)

    def _advance(self) -> None:
        assert self._brain is not None
        data, step, now = self._data, self._step, self._step - self._first
        wanted = _targets(self._brain, now, self._observer.observe(data), data.ctrl.shape)
        data.ctrl[:] = self._guard.limit(wanted, data)
        self._push.apply(data)
        before = perf_counter()
        mujoco.mj_step(self.model, data)
        self._simulation_s += perf_counter() - before
        diverged = divergence(data)
        if diverged:
            self._ending, self._stopped = (DIVERGED, diverged, step, None), True
            return
        if self._records:
            for recorder in self._recorders:
                recorder.step(step, data)
                recorder.state(step + 1, data)
            self._between.step(step, data)
        rule = self._settings.fall
        falls = [
            fall(data, recorder.body, reference, now + 1, recorder.ground, rule)
            for recorder, reference in zip(self._recorders, self._references)
        ]
        self._step = step + 1
        self._falls = {number: words for number, words in enumerate(falls) if words}
        self._fallen = tuple(self._falls)
        if self._fallen and self._ending is None:
            self._ending = FELL, falls[self._fallen[0]], self._step, self._fallen[0]
            self._stopped = not self._stands
        if not self._stands and not self._stopped and now + 1 == len(self._references[0].qpos) - 1:
            self._ending, self._stopped = (DONE, "the motion ended", self._step, None), True


@contextmanager
def quiet_warnings() -> Iterator[None]:
    """Silence MuJoCo's warnings and log file; a run reports its end, and rejected samples, itself."""
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda message: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)


def _targets(controller: Controller, step: int, data: mujoco.MjData, shape: tuple[int, ...]) -> FloatArray:
    targets = controller.target(step, data)
    if np.shape(targets) != shape:
        raise SettingError(
            f"controller {controller.name!r}: target() returned shape {np.shape(targets)}; valid: {shape}, "
            "one angle for each actuator of the scene"
        )
    return targets
