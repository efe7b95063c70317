"""`python -m ramsight` is the command line."""

from ramsight.cli import main

main()
