"""Simulation of bodies that track motions."""
