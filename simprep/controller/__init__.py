"""2013 paper: motion graph, states and rewards, learning, and the controller that prepares at run time."""
