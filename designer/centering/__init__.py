"""Designs that spread cannot spoil: the search for the highest yield, and the cheapest repair.

It calls match, circuit and prediction again and again; nothing below imports it.
"""
