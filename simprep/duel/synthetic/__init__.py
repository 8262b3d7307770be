"""A choreographed stream of two fighters with known truth, made from the built-in motions."""
