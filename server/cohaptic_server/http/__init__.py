"""The HTTP service: pure functions that turn a request into a response.

Terms:
    page: The web page of the server, built by `make page`; also any other page where one is named.
    origin: Scheme, host and port of the page that makes a request (Origin header).
    host: Name or address to which a browser connects (Host header), with a port if any.
    target: Path and query of a request.
    peer: Machine at the other end of a connection.
    native client: Client that is no browser, and so sends no origin.
    block of Green's functions: Displacement of all vertices per unit force on one vertex in x, y
        and z [m/N], encoded for a page.
"""
