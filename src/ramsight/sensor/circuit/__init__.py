"""The circuit's balance under a load that the torque corrects, and what is uncertain of it."""
