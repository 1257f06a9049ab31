"""What lies in the folder of a design or of a sweep: each file as it is written and read again,
with the JSON answers and where they come from."""
