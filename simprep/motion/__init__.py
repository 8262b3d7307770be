"""Motions: the Motion class, editing, contacts, files, retargeting."""
