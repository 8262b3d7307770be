"""Readers of foreign motion files."""
