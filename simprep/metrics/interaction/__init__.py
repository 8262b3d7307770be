"""How people fight, in numbers: recorded streams, synthesised and simulated fights."""
