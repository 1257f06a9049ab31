"""What can be bought: part families, op-amps, diodes, references, each figure with its source.

Catalogues are data files; this package reads them, checks them and answers what is sold. The
limits of the design rules are data as well.
"""
