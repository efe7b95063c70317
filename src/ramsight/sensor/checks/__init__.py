"""Reports of the drive that are held against each other."""
