"""What each of the two does: a stream cut into actions, and the labels of the actions."""
