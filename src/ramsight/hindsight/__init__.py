"""Where the piston was, by all that a recorded log says: fixed-interval smoothing of the sensor's hypotheses."""
