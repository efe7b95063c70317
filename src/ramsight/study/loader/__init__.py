"""A machine in motion: its mechanism drawn to scale.

python -m ramsight.study.loader mining-loader loader.png
"""
