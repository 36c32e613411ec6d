"""Upload of mesh files by pages: one upload at a time, read in a separate process.

`upload_desk.py` is the server's side, `worker.py` the process that reads a stranger's file and
prepares the object; `pipe.py` carries numbers and texts between them, never objects of Python.
"""
