"""In how many of many runs does it fall: parameters, starts, noise and faults drawn at random."""
