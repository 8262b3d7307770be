"""Replays: bodies moving in 3-D, recorded for a page that opens from disk."""
