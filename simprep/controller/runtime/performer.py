"""A character at run time: actions are turned into frames one by one; frames already shown stay as they are.

Each action is synthesised in a window: some frames already shown, its own, and some beyond it, since a foot in the air
must know where it will land. What differs from the last window (`Seam`) dies away over a few frames.
"""

from dataclasses import dataclass, field
from time import process_time

import numpy as np

from simprep.arrays import FloatArray
from simprep.controller.alpha_filter import filter_kernel
from simprep.controller.influence import style_from_vectors, style_vector
from simprep.controller.runtime.locomotion import CoreNodes, LocomotionStream
from simprep.errors import SettingError
from simprep.motion.curves import dying_away
from simprep.motion.motion import Motion
from simprep.preparation.blending import joint_weights
from simprep.preparation.settings import DEFAULT_SETTINGS, PreparationSettings
from simprep.preparation.synthesis import Seam, Style, Synthesis, synthesise
from simprep.preparation.trajectory import blend_root


@dataclass(frozen=True)
class RuntimeSettings:
    """How a character is synthesised at run time.

    Attributes:
        optimise: whether to run the posture optimisation.
        preparation: every constant of the synthesis.
        smoothing: standard deviation of the Gaussian over alpha and style [s] (`simprep.controller.alpha_filter`).
        look_back: least part of a window that was shown already [s].
        look_ahead: part of a window beyond its action [s].
        fade: time over which what differs between two windows dies away [s]; half of it for legs and root height, since
            a foot in the air may soon land.

    Raises:
        SettingError: a time that is not positive.
    """

    optimise: bool = True
    preparation: PreparationSettings = field(default=DEFAULT_SETTINGS)
    smoothing: float = 0.08
    look_back: float = 0.2
    look_ahead: float = 0.35
    fade: float = 0.2

    def __post_init__(self) -> None:
        for name in ("smoothing", "look_back", "look_ahead", "fade"):
            if not getattr(self, name) > 0:
                raise SettingError(f"run time: {name} {getattr(self, name)} s; valid: above 0")


class Performer:
    """One character; `act` makes the frames of one action.

    Args:
        cores: the core nodes.
        settings: of the synthesis.
        node: core node to begin with.
        frame: its frame to begin with.
        place: (x, y [m], heading [rad]) to begin at.
        level: level of preparation to begin at.
        style: what is prepared for at the beginning.
    """

    def __init__(
        self,
        cores: CoreNodes,
        settings: RuntimeSettings | None = None,
        node: str = "walk",
        frame: int = 0,
        place: tuple[float, float, float] = (0.0, 0.0, 0.0),
        level: float = 0.0,
        style: Style | None = None,
    ) -> None:
        self.settings = settings or RuntimeSettings()
        self.stream = LocomotionStream(cores, node, frame, place)
        self.fps = self.stream.fps
        self.node = node
        self._kernel = filter_kernel(self.settings.smoothing, self.fps)
        self._memory = len(self._kernel) - 1
        first = style or Style(self.stream.window(0, 1).qpos[0], np.zeros(2), np.ones(2, dtype=bool))
        # commands, with what was commanded before the first frame
        self._commands = np.full(self._memory, level)
        self._share = np.full(self._memory, 1.0)
        self._styles = np.repeat(style_vector(first)[None], self._memory, axis=0)
        self._last: Synthesis | None = None
        self._last_start = 0
        self._qpos = np.empty((0, self.stream.character.nq))
        self._contacts = np.empty((0, 2), dtype=bool)
        self.level = np.empty(0)
        self.synthesis_s = 0.0
        self.place = place

    def __len__(self) -> int:
        return len(self._qpos)

    @property
    def command(self) -> float:
        """Level of preparation commanded last."""
        return float(self._commands[-1])

    def motion(self, name: str = "approach") -> Motion:
        """Everything shown so far."""
        return Motion(
            self._qpos, self.fps, self._contacts, name=name, source="simprep run time", character=self.stream.character
        )

    def turn_to(self, node: str, frames: int) -> None:
        """Go over to a core node at the first frame of the next action (of `frames`) from which the graph allows it.

        The present node, or one that cannot be reached in time, changes nothing.
        """
        if node != self.node and self.stream.change(node, len(self), frames) is not None:
            self.node = node

    def path(self, commands: FloatArray, share: float = 1.0) -> FloatArray:
        """Root path (T, 3) under these commands, x, y [m] and heading [rad], without synthesising the body.

        Args:
            commands: (T,) level of preparation commanded in every frame.
            share: see `act`.
        """
        begin = max(len(self) - 1, 0)
        source = self.stream.window(begin, len(self) + len(commands))
        level = self._filtered(self._commands, commands)[-len(source.qpos) :]
        shares = self._filtered(self._share, np.full(len(commands), share))[-len(source.qpos) :]
        weight, _ = joint_weights(level, self.stream.character, self.settings.preparation)
        seam = Seam() if self._last is None else self._last.seam(begin - self._last_start)
        tilt = style_from_vectors(self._styles[-1]).qpos
        root = blend_root(source.qpos[:, :7], tilt, weight * shares, source.trend, (seam.lag, seam.lost))
        return np.column_stack([root.position, source.trend + root.lag])[-len(commands) :]

    def act(self, commands: FloatArray, style: Style, share: float = 1.0) -> Motion:
        """Make the new frames of one action.

        Args:
            commands: (T,) level of preparation commanded in every frame; the Gaussian filter makes it smooth.
            style: what is prepared for, one posture.
            share: probability that there will be a target at all.
        """
        begun = process_time()
        s = self.settings
        first, count = len(self), len(commands)
        ahead = round(s.look_ahead * self.fps)
        start = self._window_start(first)
        self._commands = np.concatenate([self._commands, commands])
        self._share = np.concatenate([self._share, np.full(count, share)])
        self._styles = np.concatenate([self._styles, np.repeat(style_vector(style)[None], count, axis=0)])
        source = self.stream.window(start, first + count + ahead)
        level, shares, styles = (
            self._filtered(signal[start:], np.repeat(signal[-1:], ahead, axis=0))
            for signal in (self._commands, self._share, self._styles)
        )
        level = np.clip(level, 0.0, 1.0)
        seam = None if self._last is None else self._last.seam(start - self._last_start)
        made = synthesise(
            source, style_from_vectors(styles), level, s.preparation, s.optimise, seam, measure=False, share=shares
        )
        skip = first - start
        qpos = made.qpos[skip : skip + count].copy()
        if first > 0:
            self._join(qpos, made.qpos[max(skip - 2, 0) : skip])
        self._qpos = np.concatenate([self._qpos, qpos])
        self._contacts = np.concatenate([self._contacts, made.contacts[skip : skip + count]])
        self.level = np.concatenate([self.level, level[skip : skip + count]])
        self._last, self._last_start = made, start
        end = skip + count - 1
        self.place = (float(qpos[-1, 0]), float(qpos[-1, 1]), float(source.trend[end] + made.lag[end]))
        self.synthesis_s += process_time() - begun
        return Motion(qpos, self.fps, self._contacts[first:], name="action", character=self.stream.character)

    def _filtered(self, before: FloatArray, after: FloatArray) -> FloatArray:
        """Causal Gaussian filter; as many values as `after` and `before` have, less the filter's memory."""
        signal = np.concatenate([before, after])
        windows = np.lib.stride_tricks.sliding_window_view(signal, len(self._kernel), axis=0)
        return np.asarray(windows @ self._kernel)

    def _window_start(self, first: int) -> int:
        """Early enough that a foot now in the air was still on the floor."""
        start = max(first - round(self.settings.look_back * self.fps), 0)
        if first == 0:
            return 0
        contacts = self.stream.window(0, first).contacts
        for side in (0, 1):
            grounded = np.flatnonzero(contacts[:, side])
            if not contacts[-1, side] and len(grounded):
                start = min(start, max(int(grounded[-1]) - 2, 0))
        return max(start, self._last_start)

    def _join(self, qpos: FloatArray, window: FloatArray) -> None:
        """Let what differs from the frames already shown die away, in place: hinges and root height."""
        shown, made = self._qpos[-len(window) :], qpos[:, 7:].copy()
        character = self.stream.character
        upper, lower = 7 + character.upper_joints, np.r_[2, 7 + character.lower_joints]
        for columns, share in ((upper, 1.0), (lower, 0.5)):
            gap = (shown - window)[:, columns]
            slope = gap[-1] - gap[-2] if len(gap) > 1 else np.zeros(len(columns))
            frames = min(round(share * self.settings.fade * self.fps), len(qpos))
            x = np.arange(1, frames + 1)[:, None] / (frames + 1)
            fade = dying_away(x, gap[-1], slope * (frames + 1))
            qpos[:frames, columns] += fade
        low, high = self.stream.character.model.jnt_range[1:].T
        qpos[:, 7:] = np.where(np.abs(qpos[:, 7:] - made) > 0, np.clip(qpos[:, 7:], low, high), qpos[:, 7:])
