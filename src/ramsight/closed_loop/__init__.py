"""Does it get there: cylinders, drives, sensors and controls simulated together, where truth and estimate meet."""
