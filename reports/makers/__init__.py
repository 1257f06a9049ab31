"""What makes the reports on the systems of ``examples/`` and on the search for a robust design.

Run a module from the repository's root, such as ``python -m reports.makers.example_report``.
"""
