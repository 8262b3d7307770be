"""What a simulation returns: everything needed to judge it, and nothing that was not simulated."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from simprep.arrays import BoolArray, FloatArray
from simprep.display import SelfShowing, data_frame
from simprep.errors import MotionError
from simprep.motion.edit import cut
from simprep.motion.motion import Motion, pose_columns
from simprep.physics.contacts import BodyContact

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DONE, FELL, DIVERGED = "done", "fell", "diverged"
ENDS = (DONE, FELL, DIVERGED)

T = TypeVar("T")


@dataclass(frozen=True)
class Assist:
    """Largest external force [N], torque [N m] and kick [m/s, rad/s] anywhere in a run (never the controllers')."""

    force_n: float = 0.0
    torque_nm: float = 0.0
    kick_mps: float = 0.0
    kick_radps: float = 0.0


@dataclass(frozen=True, eq=False, repr=False)
class BodyRun:
    """What one body did in a run: N simulation steps, N + 1 states.

    Attributes:
        reference: the processed motion that was tracked, at the simulation rate; it may go on after the run's end.
        qpos: (N + 1, nq) simulated states.
        qvel: (N + 1, nv).
        reference_qvel: (N + 1, nv) of the reference at the same times.
        target: (N, joints) servo targets [rad].
        torque: (N, joints) servo torques after their limits [N m].
        torque_limit: (joints,) limits [N m].
        ground_force: (N, 3) force of the floor and obstacles on the body, world frame [N].
        foot_force: (N, 2, 3) the part of it on the left and right foot [N].
        centre_of_pressure: (N, 2) on the floor [m]; NaN while the floor bears less than 20 N.
        foot_contact: (N, 2) whether each foot bears more than 20 N.
        penetration: (N,) deepest overlap of any geom with the floor [m], 0 or more.
        processing: what was done to the motion before tracking (smoothing, height correction, start state).

    Raises:
        MotionError: arrays that do not belong together.
    """

    reference: Motion
    qpos: FloatArray
    qvel: FloatArray
    reference_qvel: FloatArray
    target: FloatArray
    torque: FloatArray
    torque_limit: FloatArray
    ground_force: FloatArray
    foot_force: FloatArray
    centre_of_pressure: FloatArray
    foot_contact: BoolArray
    penetration: FloatArray
    processing: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        steps, states = len(self.torque), len(self.torque) + 1
        joints, n_qvel = self.torque_limit.shape[0], self.qvel.shape[-1]
        valid = {
            "qpos": (states, self.reference.qpos.shape[1]), "qvel": (states, n_qvel), "reference_qvel": (states, n_qvel),
            "target": (steps, joints), "torque": (steps, joints), "torque_limit": (joints,),
            "ground_force": (steps, 3), "foot_force": (steps, 2, 3), "centre_of_pressure": (steps, 2),
            "foot_contact": (steps, 2), "penetration": (steps,),
        }  # fmt: skip
        for name, shape in valid.items():
            if getattr(self, name).shape != shape:
                raise MotionError(f"run of {self.reference.name}: {name} {getattr(self, name).shape}; valid: {shape}")
        if len(self.reference) < states:
            raise MotionError(f"run of {self.reference.name}: {states} states of a reference of {len(self.reference)}")

    @property
    def reference_qpos(self) -> FloatArray:
        """(N + 1, nq) the reference at the times of the states."""
        return self.reference.qpos[: len(self.qpos)]

    def __repr__(self) -> str:
        return f"BodyRun({self.reference.name}, {len(self.torque)} steps)"

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Every array by its name."""
        values = {one.name: getattr(self, one.name) for one in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}


class _OfTheOnlyBody(Generic[T]):
    """An attribute of the only body, on the run; on a run of several, an error that says how to ask."""

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, run: None, owner: type) -> "_OfTheOnlyBody[T]": ...
    @overload
    def __get__(self, run: "Run", owner: type) -> T: ...
    def __get__(self, run: "Run | None", owner: type) -> "T | _OfTheOnlyBody[T]":
        if run is None:
            return self
        if len(run.bodies) != 1:
            count = len(run.bodies)
            raise AttributeError(
                f"a run of {count} bodies has no {self._name} of its own; use run.body(0).{self._name}"
            )
        value: T = getattr(run.bodies[0], self._name)
        return value


@dataclass(frozen=True, eq=False, repr=False)
class Run(SelfShowing):
    """A simulation of one body or several in one world: N steps, N + 1 states.

    A run of one body has the attributes of its `BodyRun` too: `run.qpos`, `run.torque`, `run.reference`. Of several,
    `run.body(k)` is the run of one. `run[a:b]` is steps a to b - 1. Two runs are equal if their files would be.

    Attributes:
        bodies: what each body did; all end when the first falls.
        controller: name of the controller.
        seed: seed of its random generator.
        timestep: simulation step [s].
        end: `done`, `fell` or `diverged`.
        end_reason: the rule that ended the run, in words.
        fallen: number of the body that fell; None if none did.
        contacts: between the bodies, by time.
        overlap: (N,) deepest overlap between two bodies [m], 0 or more.
        reference_overlap: (N,) the same of the references.
        unconverged: (N,) whether the contact solver ran out of iterations; do not trust the forces of such a step.
        settings: the controller's configuration, in JSON's types.
        assist: external forces used.
        wall_s: computing time [s].
        overhead_share: share of the computing time spent outside MuJoCo.

    Raises:
        MotionError: no body, an unknown end, or bodies and arrays of different lengths.
    """

    bodies: tuple[BodyRun, ...]
    controller: str
    seed: int
    timestep: float
    end: str
    end_reason: str
    fallen: int | None = None
    contacts: tuple[BodyContact, ...] = ()
    overlap: FloatArray = field(default_factory=lambda: np.zeros(0))
    reference_overlap: FloatArray = field(default_factory=lambda: np.zeros(0))
    unconverged: BoolArray = field(default_factory=lambda: np.zeros(0, dtype=bool))
    settings: Mapping[str, Any] = field(default_factory=dict)
    assist: Assist = field(default_factory=Assist)
    wall_s: float = 0.0
    overhead_share: float = 0.0

    reference = _OfTheOnlyBody[Motion]()
    processing = _OfTheOnlyBody[Mapping[str, Any]]()
    qpos = _OfTheOnlyBody[FloatArray]()
    qvel = _OfTheOnlyBody[FloatArray]()
    reference_qpos = _OfTheOnlyBody[FloatArray]()
    reference_qvel = _OfTheOnlyBody[FloatArray]()
    target = _OfTheOnlyBody[FloatArray]()
    torque = _OfTheOnlyBody[FloatArray]()
    torque_limit = _OfTheOnlyBody[FloatArray]()
    ground_force = _OfTheOnlyBody[FloatArray]()
    foot_force = _OfTheOnlyBody[FloatArray]()
    centre_of_pressure = _OfTheOnlyBody[FloatArray]()
    foot_contact = _OfTheOnlyBody[BoolArray]()
    penetration = _OfTheOnlyBody[FloatArray]()

    def __post_init__(self) -> None:
        if not self.bodies:
            raise MotionError("a run of no body; valid: one or more")
        if self.end not in ENDS:
            raise MotionError(f"a run that ended {self.end!r}; valid: {', '.join(ENDS)}")
        for name in ("overlap", "reference_overlap", "unconverged"):
            value = getattr(self, name)
            if not len(value):  # left out by the caller: none occurred
                object.__setattr__(self, name, np.zeros(self.steps, dtype=value.dtype))
        lengths = {len(one.torque) for one in self.bodies}
        lengths |= {len(one) for one in (self.overlap, self.reference_overlap, self.unconverged)}
        if len(lengths) > 1:
            raise MotionError(
                f"a run whose parts have {', '.join(map(str, sorted(lengths)))} steps; valid: all the same"
            )

    @property
    def steps(self) -> int:
        """Number of simulation steps N."""
        return len(self.bodies[0].torque)

    @property
    def time(self) -> FloatArray:
        """(N + 1,) time of each state [s], from 0."""
        return np.arange(self.steps + 1, dtype=np.float64) * self.timestep

    @property
    def end_s(self) -> float:
        """Time of the last state [s]."""
        return self.steps * self.timestep

    @property
    def fell_at_s(self) -> float | None:
        """Time of the fall [s]; None if nobody fell."""
        return None if self.fallen is None else self.end_s

    @property
    def unconverged_steps(self) -> int:
        """Steps in which the contact solver ran out of iterations."""
        return int(self.unconverged.sum())

    @property
    def completed_share(self) -> float:
        """Share of the references' duration that was simulated, 0 to 1."""
        whole = self.bodies[0].reference.duration
        return 1.0 if whole <= 0 else min(1.0, self.end_s / whole)

    def body(self, number: int) -> "Run":
        """One body's part as a run, from 0. It ends when the whole did; it fell only if this body did.

        Raises:
            MotionError: there is no such body.
        """
        if not 0 <= number < len(self.bodies):
            raise MotionError(f"body {number} of a run of {len(self.bodies)}; valid: 0 to {len(self.bodies) - 1}")
        nothing = np.zeros(0)
        return replace(
            self,
            bodies=(self.bodies[number],),
            fallen=0 if self.fallen == number else None,
            contacts=(),
            overlap=nothing,
            reference_overlap=nothing,
        )

    def simulated_motion(self) -> Motion:
        """The simulated poses of the only body, at the simulation rate; contacts are the measured ones."""
        contacts = np.zeros((len(self.qpos), 2), dtype=bool)
        contacts[:-1] = self.foot_contact  # MuJoCo finds the contacts of a step at the state before it
        contacts[-1:] = self.foot_contact[-1:] if self.steps else False
        return Motion(
            qpos=self.qpos,
            fps=1.0 / self.timestep,
            contacts=contacts,
            name=f"{self.reference.name}_{self.controller}",
            source=f"simulated: {self.reference.source}",
            character=self.reference.character,
        )

    def __getitem__(self, steps: slice) -> "Run":
        """Steps `run[a:b]`, with time from 0 and the contacts that begin in them. `assist` stays that of the whole run.

        A part that stops before the end is `done`, and its references end there.

        Raises:
            MotionError: an empty part, or a stride.
        """
        if not isinstance(steps, slice) or steps.step not in (None, 1):
            raise MotionError("a part of a run is run[a:b] in steps, without a stride")
        first, after, _ = steps.indices(self.steps)
        if first >= after:
            raise MotionError(f"steps {first}:{after} of a run of {self.steps}; valid: 0 <= a < b <= {self.steps}")
        to_the_end = after == self.steps

        def part(body: BodyRun) -> BodyRun:
            last = len(body.reference) if to_the_end else after + 1
            arrays: dict[str, Any] = {name: value[_rows(name, first, after)] for name, value in body.arrays().items()}
            return replace(body, reference=cut(body.reference, first, last), **arrays)

        begin = first * self.timestep
        begun = [one for one in self.contacts if first <= round(one.start_s / self.timestep) < after]
        rows = slice(first, after)
        whole: dict[str, Any] = (
            {} if to_the_end else {"end": DONE, "fallen": None, "end_reason": f"steps {first} to {after} of a run"}
        )
        return replace(
            self,
            bodies=tuple(part(body) for body in self.bodies),
            contacts=tuple(replace(one, start_s=one.start_s - begin) for one in begun),
            overlap=self.overlap[rows],
            reference_overlap=self.reference_overlap[rows],
            unconverged=self.unconverged[rows],
            wall_s=self.wall_s * (after - first) / self.steps,
            **whole,
        )

    def seconds(self, start_s: float = 0.0, stop_s: float | None = None) -> "Run":
        """A part of the run by time, to the nearest step (see `run[a:b]`).

        Args:
            start_s: its first state [s].
            stop_s: its last state [s]; None for the end.
        """
        return self[round(start_s / self.timestep) : None if stop_s is None else round(stop_s / self.timestep)]

    def facts(self) -> tuple[str, Mapping[str, Any]]:
        """What `rich.print(run)` and Jupyter show."""
        return " | ".join(one.reference.name for one in self.bodies), {
            "controller": f"{self.controller}, seed {self.seed}",
            "end": f"{self.end}: {self.end_reason}",
            "simulated [s]": f"{self.end_s:.2f} of {self.bodies[0].reference.duration:.2f}",
            "steps": f"{self.steps} of {1000 * self.timestep:.3g} ms",
            "bodies": ", ".join(one.reference.character.name for one in self.bodies),
            "contacts between bodies": len(self.contacts) if len(self.bodies) > 1 else None,
            "largest external force [N]": self.assist.force_n,
            "largest kick [m/s]": self.assist.kick_mps or None,
            "computing time [s]": round(self.wall_s, 2),
        }

    def to_dataframe(self) -> Any:
        """The only body's states and forces as a pandas DataFrame, one row a state, indexed by `time_s`.

        Columns: those of the simulated poses (`Motion.to_dataframe`), a torque `JOINT_nm` for each joint,
        `ground_force_x_n` ... and `centre_of_pressure_x_m` ...; the last state has no forces (NaN).

        Raises:
            MissingExtraError: pandas is not installed.
        """
        columns = pose_columns(self.qpos, self.reference.character)

        def add(values: FloatArray, names: Sequence[str]) -> None:
            padded = np.pad(values, ((0, 1), (0, 0)), constant_values=np.nan)
            columns.update({name: padded[:, number] for number, name in enumerate(names)})

        add(self.torque, [f"{joint}_nm" for joint in self.reference.character.joints])
        add(self.ground_force, [f"ground_force_{axis}_n" for axis in "xyz"])
        add(self.centre_of_pressure, [f"centre_of_pressure_{axis}_m" for axis in "xy"])
        return data_frame(columns, self.time, "time_s")

    def save(self, path: str | Path) -> Path:
        """Write the run to a file (see `simprep.physics.store.save_run`)."""
        from simprep.physics.store import save_run

        return save_run(self, path)

    def plot(self, joints: str | Sequence[str] | None = None, path: str | Path | None = None) -> "Figure":
        """Draw the only body's motion beside its reference, torques and the end; see `simprep.report.motion_figure.plot_run`.

        Args:
            joints: names of joints or of groups of joints of the character (`left_arm`), one or several; None for all.
            path: PNG file to write as well; None to write none.

        Raises:
            UnknownNameError: no such joint or group.
            MissingExtraError: matplotlib is not installed.
        """
        from simprep.report.motion_figure import plot_run

        return plot_run(self, joints, path)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Run):
            return NotImplemented
        from simprep.physics.store import run_parts

        (header, arrays), (other_header, others) = run_parts(self), run_parts(other)
        return (
            header == other_header
            and arrays.keys() == others.keys()
            and all(np.array_equal(one, others[name], equal_nan=one.dtype.kind == "f") for name, one in arrays.items())
        )

    __hash__ = None  # type: ignore[assignment]

    def __reduce__(self) -> tuple[Callable[..., "Run"], tuple[Any, ...]]:
        from simprep.physics.store import run_of_parts, run_parts

        return run_of_parts, run_parts(self)

    def __repr__(self) -> str:
        names = " | ".join(one.reference.name for one in self.bodies)
        return f"Run({names}, {self.controller}, seed {self.seed}: {self.end} at {self.end_s:.2f} s)"


def _rows(name: str, first: int, after: int) -> slice:
    """Rows of an array of `BodyRun` that belong to some steps."""
    if name == "torque_limit":
        return slice(None)
    return slice(first, after + 1 if name in ("qpos", "qvel", "reference_qvel") else after)
