"""New fights drawn from a transition model: choice, placement, timing and stitching of actions."""
