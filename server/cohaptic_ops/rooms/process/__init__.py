"""The process of one room, what it is started from, and how connections and words reach it."""
