"""A machine with a mechanism: drawn to scale, and its runs with their tracks as an animation.

python -m ramsight.showcase.loader mining-loader loader.png
"""
