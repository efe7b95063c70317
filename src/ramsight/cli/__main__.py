"""`python -m ramsight.cli` is the command line, as `python -m ramsight` is."""

from ramsight.cli import main

main()
