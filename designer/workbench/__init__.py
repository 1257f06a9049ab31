"""A board on the bench: what an oscilloscope recorded of it, and what the record shows.

``record_formats`` reads the files that oscilloscopes write; ``channel_roles`` says what their
channels are of the board; ``naming`` says which response a record shows, and how sure that is. What
the nominal board would show is in ``prediction``. ``board_fit`` finds the board of the spread that
a record is of, and ``fitted_board`` says which figures of it the record tells. ``advice`` says
what to turn or to change for a wanted response on it, and ``spread_estimate`` what many such boards
say of the spread.
"""
