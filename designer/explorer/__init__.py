"""A local page on which sliders move the parameters of a model and the response follows at once.

``server.serve`` serves it; ``ViewMaker`` computes what it shows, and needs no page.
"""
