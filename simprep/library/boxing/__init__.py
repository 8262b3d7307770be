"""Guard, punches, blocks and dodges of a boxer."""
