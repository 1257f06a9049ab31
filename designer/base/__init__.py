"""What every package needs and no field owns: errors, units, checks of input, whole-file writes.

Nothing here knows of mechanics, circuits or studies. The design folder, progress, threads and the
style of the figures live here too.
"""
