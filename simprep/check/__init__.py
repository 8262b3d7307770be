"""Check before you train: what is wrong with a motion, can a body follow it, and what can be mended."""
