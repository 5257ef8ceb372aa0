"""`python -m skinfit`: the command line."""

from .command import main

main()
