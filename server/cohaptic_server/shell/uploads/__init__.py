"""Files that pages bring: the desk that takes one at a time, and the talk about it."""
