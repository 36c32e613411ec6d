"""Devices behind their makers' libraries, which are loaded when one of them is chosen."""
