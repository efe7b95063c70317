"""A mechanism drawn to scale: its bodies as shapes in a plane, and what stands around them."""
