"""Experiments on the real server and client code; the only package that may import both sides."""
