"""Test meshes, and a check of the laws of an elastic body, for tests, benchmarks and users.

Terms:
    load: Force on a body through one contact, spread over vertices by shares that sum to 1 [N].
    depth: Displacement of a contact along its force, averaged by these shares [m].
    compliance C: Matrix of depths per force between contacts, C_ij for contact i by force j [m/N].
    steady: Of a response: constant loads no longer change it from tick to tick.
    law: Function that asserts one property of every elastic body; its docstring states it.
"""

from cohaptic_server.testing.body_form import BrokenLawError
from cohaptic_server.testing.check_body import check_body

__all__ = ["BrokenLawError", "check_body"]
