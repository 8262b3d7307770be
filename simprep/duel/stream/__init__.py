"""People in one frame: streams, their files, and where they come from."""
