"""What counts as a seed of random numbers."""

from typing import Any

import numpy as np

from simprep.errors import SettingError


def checked_seed(seed: Any) -> int:
    """A seed as it was given; SettingError if it is no whole number from 0 on."""
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise SettingError(f"seed {seed!r}; valid: a whole number, 0 or more")
    return int(seed)
