"""`python -m cohaptic` is the command line `cohaptic`."""

from cohaptic.cli.app import main

main()
