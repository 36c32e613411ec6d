"""What hypothesis draws from in several tests."""

from __future__ import annotations

import struct

from hypothesis import strategies as st

from cohaptic.protocol.contact_sample import ContactSample
from cohaptic.protocol.patch import Geometry, Patch
from cohaptic.vec import Vec3, unit


def single(x: float) -> float:
    """The nearest number that survives the wire's 32 bits."""
    return float(struct.unpack("<f", struct.pack("<f", x))[0])


def floats(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(single(low), single(high), width=32)


def vectors(limit: float) -> st.SearchStrategy[Vec3]:
    part = floats(-limit / 2, limit / 2)
    return st.tuples(part, part, part)


counts = st.integers(1, 2**32 - 1)
times = st.floats(-1e9, 1e9)
# On the wire a normal has 32 bits per component and stays within a thousandth of unit length.
normals = (
    vectors(1.0).map(lambda v: tuple(single(c) for c in unit(v))).map(lambda v: (v[0], v[1], v[2]))
)

contact_samples = st.builds(
    ContactSample,
    seq=counts,
    tick=st.integers(0, 2**32 - 1),
    t_client=times,
    probe=vectors(10.0),
    force=vectors(100.0),
)

patches = st.builds(
    Patch,
    tick=counts,
    seq=st.integers(0, 2**32 - 1),
    t_server=times,
    t_client=times,
    sample_wait=floats(0.0, 100.0),
    geometry=st.sampled_from(Geometry),
    x_free=vectors(10.0),
    normal=normals,
    curvature=floats(-100.0, 100.0),
    k_o=floats(0.0, 1e5),
    k_o_coupled=floats(0.0, 1e5),
    c_ii=floats(0.0, 1.0),
    k_h=floats(0.0, 1e5),
    integral_gain=floats(0.0, 1e6),
    own_force=floats(0.0, 100.0),
    u_others=floats(-1.0, 1.0),
)
