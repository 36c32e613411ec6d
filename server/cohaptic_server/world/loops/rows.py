"""What the loops over all users read and write: arrays by their names, checked at the door.

Inside a compiled loop nothing is checked. So each structure checks the type of its arrays and all
lengths when it is made: two arrays in the wrong order are an error there, and never memory.
"""

from __future__ import annotations

from cohaptic_server.numeric import Floats, Ints


class ContactRows:
    """Contacts of n users, or room for them; the arguments are those of `contact.Contacts`.

    Raises:
        ValueError: An array has another type, or the lengths do not fit each other.
    """

    def __init__(
        self, frames: Floats, slopes: Floats, starts: Ints, vertices: Ints, weights: Floats
    ) -> None:
        self.frames = frames
        self.slopes = slopes
        self.starts = starts
        self.vertices = vertices
        self.weights = weights
        self.n: int = frames.shape[0]
        if frames.shape[1] != 3 or frames.shape[2] != 3:
            raise ValueError("a frame of a contact has the shape (3, 3)")
        same("slopes", slopes.shape[0], self.n)
        same("weights", weights.shape[0], vertices.shape[0])
        check_starts(starts, self.n, vertices.shape[0])


class FieldRows:
    """Fields of n users; the arguments are those of `displacement_field.KnownFields`.

    Raises:
        ValueError: An array has another type, or the lengths do not fit each other.
    """

    def __init__(self, starts: Ints, vertices: Ints, values: Floats) -> None:
        self.starts = starts
        self.vertices = vertices
        self.values = values
        self.n: int = starts.shape[0] - 1
        same("axes of a displacement", values.shape[1], 3)
        check_starts(starts, self.n, min(vertices.shape[0], values.shape[0]))


class WindowRows:
    """Windows of n users, or room for them; the arguments are those of `patch_geometry.Windows`.

    Raises:
        ValueError: An array has another type, or the lengths do not fit each other.
    """

    def __init__(
        self, geometry: Ints, keys: Floats, starts: Ints, vertices: Ints, fitted: Ints,
        touched: Ints, carried: Ints,
    ) -> None:  # fmt: skip
        self.geometry = geometry
        self.keys = keys
        self.starts = starts
        self.vertices = vertices
        self.fitted = fitted
        self.touched = touched
        self.carried = carried
        self.n: int = geometry.shape[0]
        same("keys", keys.shape[0], self.n)
        same("numbers of a key", keys.shape[1], 7)
        same("rows of starts", starts.shape[0], 3)
        room = vertices.shape[0]
        for part in (fitted.shape[0], touched.shape[0], carried.shape[0]):
            same("places for parts of windows", part, room)
        for part in range(3):
            check_starts(starts[part], self.n, room)


class WindowRequests:
    """What n users need a window for.

    Args:
        geometry: Geometry of the users' patches, shape (n,).
        frames: Frames of the contacts, shape (n, 3, 3).
        slides: Slide of each probe along the surface while its patch is in use, shape (n, 3) [m].
        directions: Tangential velocities, shape (n, 3) [m/s].
        horizons: Time for which the patches are in use, shape (n,) [s].
        lengths, half_widths: Length of the path ahead of each contact, and distance from the path
            within which a mesh patch needs vertices, shape (n,) each [m].

    Raises:
        ValueError: An array has another type, or the lengths do not fit each other.
    """

    def __init__(
        self, geometry: Ints, frames: Floats, slides: Floats, directions: Floats, horizons: Floats,
        lengths: Floats, half_widths: Floats,
    ) -> None:  # fmt: skip
        self.geometry = geometry
        self.frames = frames
        self.slides = slides
        self.directions = directions
        self.horizons = horizons
        self.lengths = lengths
        self.half_widths = half_widths
        self.n: int = geometry.shape[0]
        if frames.shape[1] != 3 or frames.shape[2] != 3:
            raise ValueError("a frame of a contact has the shape (3, 3)")
        same("frames", frames.shape[0], self.n)
        same("slides", slides.shape[0], self.n)
        same("axes of a slide", slides.shape[1], 3)
        same("directions", directions.shape[0], self.n)
        same("axes of a direction", directions.shape[1], 3)
        for length in (horizons.shape[0], lengths.shape[0], half_widths.shape[0]):
            same("horizons, lengths and half widths", length, self.n)


class WindowLimits:
    """How far windows reach, and when they are chosen anew.

    Args:
        radius, reach, step, limit: As in `WindowVertices.choose`.
        reuse: Largest move of a contact along each axis at which its window is reused [m].
        speeding_up: Widening of a window per second of a longer horizon [m/s].
    """

    def __init__(
        self, radius: float, reach: float, step: float, limit: int, reuse: float, speeding_up: float
    ) -> None:
        self.radius = radius
        self.reach = reach
        self.step = step
        self.limit = limit
        self.reuse = reuse
        self.speeding_up = speeding_up


def same(name: str, found: int, wanted: int) -> None:
    """Raise ValueError unless a length is the one that is wanted."""
    if found != wanted:
        raise ValueError(f"{found} {name} where there must be {wanted}")


def check_starts(starts: Ints, n: int, limit: int) -> None:
    """Raise ValueError unless the parts of n users follow each other within `limit` places.

    What lies behind a start of zero is not written yet, and is not checked.
    """
    same("starts", starts.shape[0], n + 1)
    for i in range(n):
        if starts[i + 1] != 0 and not 0 <= starts[i] <= starts[i + 1] <= limit:
            raise ValueError(f"part {i} lies at {starts[i]} to {starts[i + 1]} of {limit} places")


def check_rows(before: Ints, n: int) -> None:
    """Raise ValueError unless each row is -1, or one of n."""
    for i in range(before.shape[0]):
        if not -1 <= before[i] < n:
            raise ValueError(f"row {before[i]} of {n}")
