"""The model that fights where none is given, of the built-in kickboxing stream: made once, kept in the cache folder."""

import contextlib
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from simprep.duel.model.fight_model import FightModel, read_fight_model, save_fight_model
from simprep.duel.synthetic.presets import SyntheticSettings, preset
from simprep.errors import MotionFileError
from simprep.library.cache import PACKAGES, SOURCES, cache_folder, code_key, drop_old_versions, edited_since_import

if TYPE_CHECKING:
    from simprep.duel.analysis import AnalysisSettings

SEED = 0
"""Of the stream, and of what is annotated in it."""
_FOLDERS = (*SOURCES, "duel")
_PACKAGES = (*PACKAGES, "scikit-learn")

Progress = Callable[[str, float], None]
"""Called with what is being done and the share of it that is done."""


def fight_model(path: str | Path | None = None, progress: Progress | None = None) -> FightModel:
    """The model in a folder that `simprep duel analyse` wrote; None: the built-in kickboxing stream's.

    Raises:
        MotionFileError: see `read_fight_model`.
    """
    return default_fight_model(progress) if path is None else read_fight_model(path)


def default_fight_model(progress: Progress | None = None, settings: SyntheticSettings | None = None) -> FightModel:
    """The built-in stream's model: from the cache, or made (about a minute) and put there; a damaged one is made anew.

    A tenth of the actions, those that `simprep duel label` would ask for, is annotated from the stream's truth. Streams
    of other settings than the kickboxing preset's are not cached.

    Raises:
        MissingExtraError: scikit-learn is not installed.
    """
    if settings is not None:
        return _made(settings, progress)
    folder = cache_folder() / "fights" / code_key(_FOLDERS, _PACKAGES)
    with contextlib.suppress(MotionFileError):
        return read_fight_model(folder)
    made = _made(preset("kickboxing"), progress)
    if not edited_since_import(_FOLDERS):
        with contextlib.suppress(OSError, MotionFileError):
            save_fight_model(made.model, made.stream, folder)
            drop_old_versions(folder.parent)
    return made


def model_analysis() -> "AnalysisSettings":
    """How a built-in stream is analysed for its model: annotated as proposed, with the least evaluation."""
    from simprep.duel.analysis import AnalysisSettings
    from simprep.duel.model.evaluation import EvaluationSettings
    from simprep.duel.model.semi_tied import PRIOR_COUNT

    least = EvaluationSettings(splits=1, components=(1,), prior_counts=(PRIOR_COUNT,))
    return AnalysisSettings(proposed=True, evaluation=least)


def _made(settings: SyntheticSettings, progress: Progress | None) -> FightModel:
    from simprep.duel.analysis import STAGES, analyse
    from simprep.duel.synthetic.make import make_synthetic

    say: Progress = progress or (lambda what, share: None)
    say("built-in stream", 0.0)
    example = make_synthetic(settings, SEED, lambda done, count: say("built-in stream", done / count))
    found = analyse(
        example.stream,
        np.random.default_rng(SEED),
        truth=example.truth,
        settings=model_analysis(),
        progress=lambda stage: say(stage, STAGES.index(stage) / len(STAGES)),
    )
    return FightModel(found.model, example.stream)
