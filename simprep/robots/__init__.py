"""Robots as characters: a floating-base humanoid's MJCF plus one small TOML file that says what its parts are."""
