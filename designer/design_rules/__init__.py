"""Design rules on the circuit and on a finished board, each with its limit and source."""
