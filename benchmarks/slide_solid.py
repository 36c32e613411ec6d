"""Steps of the force on a finger that slides over 150,000 tetrahedra, while columns arrive.

    python benchmarks/slide_solid.py [--json FILE]

In virtual time (`cohaptic_experiments/sliding/slide_solid.py`), by speed and delay: largest change
of the force between two haptic periods of 1 ms, over the force; the error against the exact body;
and for how long the finger had less than half of its force while it set off.
"""

from __future__ import annotations

from threadpoolctl import threadpool_limits

import json_report
from cohaptic_experiments.sliding.slide_solid import ServedSolid, slide
from cohaptic_server.bodies.solid.parts import make_parts
from cohaptic_server.bodies.solid.shape import SolidSettings
from cohaptic_server.bodies.solid.solid import Solid
from cohaptic_server.testing.soft_ring import fixed, ring


def main() -> None:
    """Print a table."""
    options = json_report.parser(__doc__).parse_args()
    results: list[json_report.Result] = []
    mesh, settings = ring(176, 96), SolidSettings(order=1)
    with threadpool_limits(limits=1):
        parts = make_parts(mesh, fixed(mesh), settings)
        exact = Solid(mesh, fixed(mesh), settings, parts=parts)
        print(f"{len(mesh.tets):,} tetrahedra, {len(exact.mesh.vertices):,} vertices of surface\n")
        print(
            "| speed | delay each way | largest step | largest error | mean force | without force |"
        )
        print("|---|---|---|---|---|---|")
        for speed, delay in (
            (0.2, 0.0),
            (0.2, 0.04),
            (0.2, 0.08),
            (0.2, 0.15),
            (0.2, 0.25),
            (0.02, 0.0),
        ):
            body = ServedSolid(mesh, fixed(mesh), settings, parts=parts)
            body.in_background()
            felt = slide(body, exact, speed=speed, delay=delay)
            print(
                f"| {speed:g} m/s | {1e3 * delay:g} ms | {felt.step:.2%} | {felt.error:.1%}"
                f" | {felt.force:.2f} N | {1e3 * felt.lost:.0f} ms |",
                flush=True,
            )
            results.append(
                {
                    "speed_m_per_s": speed,
                    "delay_s": delay,
                    "largest_step": felt.step,
                    "largest_error": felt.error,
                    "mean_force_n": felt.force,
                    "without_force_s": felt.lost,
                }
            )
    json_report.write(options, results)


if __name__ == "__main__":
    main()
