"""The JSON objects that verbs print and folders hold, as types: the keys of docs/contract.md.

A key that may be missing is ``NotRequired``: it is left out where it says nothing, or earlier
versions did not write it. A number that may not be finite is ``float | None``.
"""
