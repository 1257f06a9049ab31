"""What a maker of boards is sent: Gerbers, holes, positions and bill, packed with their hashes."""
