"""A choreographed bout of two fighters with known truth: synthetic, made from the built-in motions."""
