"""Shared fixtures."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder with real motion capture; tests that need it skip where it is absent."""
    folder = Path(os.environ.get("SIMPREP_TEST_DATA", Path(__file__).parents[1] / "../shared/data"))
    if not folder.is_dir():
        pytest.skip(f"no motion capture at {folder}; set SIMPREP_TEST_DATA to the folder that holds it")
    return folder
