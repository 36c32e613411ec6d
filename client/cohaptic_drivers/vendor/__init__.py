"""Devices that need their maker's library, which is loaded only when such a device is chosen.

Terms:
    library: Shared library of the maker, called through ctypes.
    number, handle: Number by which the library identifies an open device.
    watchdog: Timer in the device that switches its forces off after a silence of the host [s].
    servo thread: Thread of OpenHaptics that calls this program back once a millisecond.
"""
