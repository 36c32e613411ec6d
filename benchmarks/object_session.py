"""Two hands on an object from a file, in virtual time: the command; `two_hands.py` says more.

    python benchmarks/object_session.py FILE [--fix RULE ...] [--nonlinear] [--limb]
        [--law pi] [--delays-ms 0] [--hold-trips 160]

It belongs to `many_objects.py`, which reads the last line of its output.
"""

from __future__ import annotations

from cohaptic.compiled import use


def run() -> None:
    """Play the sessions with the compiled haptic loop, if there is one: the same figures sooner."""
    use("loop")  # before its modules are imported
    import typer

    from two_hands import main

    typer.run(main)


if __name__ == "__main__":
    run()
