"""Building blocks of motions: curves in time, feet, limbs, balance, whole bodies."""
