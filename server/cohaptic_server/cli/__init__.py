"""Commands of the server: serve, key, token and invite, and their options.

Terms:
    group: Dataclass whose fields are command-line options that several commands share.
    chapter: Heading in a command's help below which options are listed.
    access options: Options that say who may come in, and how connections are encrypted.
    grant: Right that a token gives to the person who has it.
    demand: Number of users and tick rate for which a mesh has to be coarse enough.
    remedy: Option, with its reason, that removes a problem of an object file.
    route: Further service of the server that an installed package adds.
"""
