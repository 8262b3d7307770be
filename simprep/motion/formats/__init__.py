"""motion/formats."""
