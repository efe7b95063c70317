"""A machine with a mechanism: drawn to scale, and its runs with what sensors make of them as an animation.

python -m ramsight.showcase.loader mining-loader loader.png
"""
