"""One trained policy per lower-body blending curve: made when first needed, then kept in the user's cache folder."""

import contextlib

from simprep.controller.best import measure
from simprep.controller.policy import Policy, read_policy, save_policy
from simprep.controller.settings import ControllerSettings, LearningSettings
from simprep.controller.training import learning_key, problem_key, run, start
from simprep.errors import MotionFileError
from simprep.library.cache import cache_folder


def trained_policy(settings: ControllerSettings | None = None, learning: LearningSettings | None = None) -> Policy:
    """A policy learned for a controller, from the cache or trained now; MissingExtraError if that needs numba.

    It is kept under a hash of the displacements, which are measured every time. So changed motions get a new policy,
    and targets whose preparation moves the root alike share one.

    Args:
        settings: the controller; its `preparation` gives the blending curve of the root.
        learning: how it learns.
    """
    settings, learning = settings or ControllerSettings(), learning or LearningSettings()
    table = measure(settings)
    path = cache_folder() / "policies" / f"{problem_key(table, settings)}-{learning_key(learning)}.npz"
    with contextlib.suppress(MotionFileError):
        known = read_policy(path)
        return Policy(known.actions, table, settings, known.origin)
    policy = run(start(table, settings, learning))
    with contextlib.suppress(OSError):
        save_policy(policy, path)
    return policy
