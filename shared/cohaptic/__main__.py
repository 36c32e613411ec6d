"""Run the command line `cohaptic` for `python -m cohaptic`."""

from cohaptic.cli.app import main

main()
