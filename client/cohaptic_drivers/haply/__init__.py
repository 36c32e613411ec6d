"""Haply Inverse3 and Minverse, through the websocket of the Haply service.

Terms:
    service: Program of the maker that controls the devices and answers on a websocket.
    arm: One Inverse3 or Minverse, and its state in a report (`Arm`).
    grip: Handle with buttons at the tip of an arm; the service lists grips beside the arms.
    exchange: One message to the service and its answer; the answer is the service's report.
    garbled: Report that is no JSON, or lacks a valid position [m] or velocity [m/s].
    heard: Newest state of the arm, with the time of its arrival [s].
"""
