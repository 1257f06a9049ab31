"""One response in three engines: the model, the exact circuit, ngspice; and whether to trust it.

``simulate`` answers for one frequency, ``check`` for all wanted responses of a design, ``Trust``
says what rounding, step or missing answers leave open.
"""
