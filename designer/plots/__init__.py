"""Pictures of orbits, sweeps, maps, studies, records and mechanisms, each readable alone."""
