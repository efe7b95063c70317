"""Where should it be: cylinders driven to positions, with a virtual sensor's estimate as the only feedback."""
