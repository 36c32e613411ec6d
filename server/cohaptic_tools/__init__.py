"""Tools: the demonstration with several hands, and the inspection of an object from a file.

Terms:
    hand: Simulated user whose probe follows a script.
    held: Fixed: the held region of an object does not move.
    prepare: To mesh an object and factorise its stiffness matrix, and to store both.
    K_o: Stiffness of the object at a contact [N/m].
    inspection: Measured properties of an object, such as K_o and the duration of a tick.
"""
