"""What `import ramsight` offers, one idea a module: thin over the rooms, quantities as SI numbers or text with a unit.

Each name is imported when it is asked for first; `ramsight.__init__` says from where.
"""
