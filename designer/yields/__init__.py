"""How many boards keep a response: tolerance studies and what they say.

As built, tuned, trimmed and reached yields, both engines' estimate, margins, attribution and maps.
``tolerance`` runs a study; ``yield_count`` is where a yield is counted.
"""
