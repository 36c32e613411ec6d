"""Haply Inverse3 and Minverse, through the websocket of the Haply service."""
