"""`python -m cohaptic` is the command line `cohaptic`."""

from cohaptic.cli import main

main()
