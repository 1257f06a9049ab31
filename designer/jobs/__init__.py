"""A verb on a design folder: read, do, write, go on where it was."""
