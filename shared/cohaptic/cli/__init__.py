"""The command `cohaptic`, and `cohaptic stability`.

Terms:
    chapter: Group of options under one heading of a command's help.
    answer: Result of `cohaptic stability`: the fields of its JSON output by name.
    lag: Time constant tau of the filter through which all forces of a room enter the body [s].
    theorem: That of science 3.8, on rooms of hands held still with a lag.
"""
