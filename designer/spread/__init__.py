"""How boards of one design differ: grades, tracking, temperature, ageing, measured values.

``spread_of`` reads it from a model file and the catalogue, ``draw`` and ``draw_many`` draw boards
from a seed and the samples' indices.
"""
