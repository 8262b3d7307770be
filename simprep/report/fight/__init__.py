"""Pictures and files of a fight."""
