"""`python -m bumblebee`: the command line, wherever the interpreter is."""

from bumblebee.cli import main

main()
