"""Shared fixtures."""

import os
from collections.abc import Iterator
from pathlib import Path

import pytest


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Cache of generated motions for this run alone, shared with the processes that tests start; no library of the user's."""
    folder = tmp_path_factory.mktemp("cache")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SIMPREP_CACHE_DIR", str(folder))
        patch.delenv("SIMPREP_LIBRARY", raising=False)
        yield folder


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder with real motion capture; tests that need it skip where it is absent."""
    folder = Path(os.environ.get("SIMPREP_TEST_DATA", Path(__file__).parents[1] / "../shared/data"))
    if not folder.is_dir():
        pytest.skip(f"no motion capture at {folder}; set SIMPREP_TEST_DATA to the folder that holds it")
    return folder


@pytest.fixture(scope="session")
def g1_model(data_dir: Path) -> Path:
    """MJCF of the Unitree G1 beside the motion capture; tests that need it skip where it is absent."""
    model = data_dir.parent / "robots" / "unitree_g1" / "g1.xml"
    if not model.is_file():
        pytest.skip(f"no model of the Unitree G1 at {model}")
    return model
