"""Who answers what with what: the coupled graph, and the transition model learned from it."""
