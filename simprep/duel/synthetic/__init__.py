"""A choreographed stream of two fighters with known truth: synthetic, made from the built-in motions."""
