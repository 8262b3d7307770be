"""Walks, turns and single steps."""
