"""simprep: physics-validated preparation motions and interactions for simulated humanoids.

The public API is re-exported here on purpose and loaded on first use, so that `import simprep` stays fast.
"""

import importlib
from typing import Any

__version__ = "0.1.0"

_EXPORTS = {
    "Body": "simprep.humanoid",
    "DuelStream": "simprep.duel.stream.stream",
    "Motion": "simprep.motion.motion",
    "PreparationSettings": "simprep.preparation.settings",
    "Run": "simprep.physics.run",
    "SimprepError": "simprep.errors",
    "evaluate_motion": "simprep.metrics.evaluate",
    "evaluate_run": "simprep.metrics.evaluate",
    "import_pair": "simprep.duel.stream.import_pair",
    "library_motion": "simprep.library.registry",
    "library_names": "simprep.library.registry",
    "load_motion": "simprep.motion.load",
    "prepare": "simprep.preparation.prepare",
    "read_run": "simprep.physics.store",
    "read_stream": "simprep.duel.stream.store",
    "save_motion": "simprep.motion.store",
    "save_run": "simprep.physics.store",
    "save_stream": "simprep.duel.stream.store",
    "scenario": "simprep.preparation.scenario",
    "segment_stream": "simprep.duel.labels.segmentation",
    "simulate": "simprep.physics.simulate",
    "track": "simprep.physics.simulate",
}

__all__ = ["__version__", *_EXPORTS]


def __getattr__(name: str) -> Any:
    if name in _EXPORTS:
        return getattr(importlib.import_module(_EXPORTS[name]), name)
    raise AttributeError(f"module 'simprep' has no attribute {name!r}; valid: {', '.join(__all__)}")


def __dir__() -> list[str]:
    return sorted(__all__)
