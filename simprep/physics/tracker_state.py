"""What a tracker tells of its bodies at one moment."""

from dataclasses import dataclass

from simprep.arrays import FloatArray


@dataclass(frozen=True)
class TrackerState:
    """Where the bodies are at one moment.

    Attributes:
        time: since the first step [s].
        bodies_qpos: (nq,) pose of each body.
        bodies_qvel: (nv,) of each.
        reference_qpos: (nq,) where the reference has each now.
        ahead_s: how much of each body's motion is left; 0 where it stands [s].
        fallen: numbers of the bodies that are down.
        end: `done`, `fell` or `diverged` where it does not go on, else empty.
    """

    time: float
    bodies_qpos: tuple[FloatArray, ...]
    bodies_qvel: tuple[FloatArray, ...]
    reference_qpos: tuple[FloatArray, ...]
    ahead_s: tuple[float, ...]
    fallen: tuple[int, ...]
    end: str

    @property
    def qpos(self) -> FloatArray:
        """(nq,) of the first body."""
        return self.bodies_qpos[0]

    @property
    def qvel(self) -> FloatArray:
        """(nv,) of the first body."""
        return self.bodies_qvel[0]
