"""How well a motion or a simulation did: pure functions, each saying what its number captures and what it hides."""
