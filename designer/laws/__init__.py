"""Forces that are not linear: laws point by point, cubic springs, friction and Hertzian contacts.

``ForceLaw`` is the force, ``NonlinearElement`` the table of a model file that stands for one.
"""
