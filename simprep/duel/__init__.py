"""2008 paper: two fighters. Segmentation, labels, transition graph and model, synthesis."""
