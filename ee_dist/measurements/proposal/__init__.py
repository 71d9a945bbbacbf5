"""A mapping proposed from a recording and a robot: by names, units, ranges, and what signals have to do with one another."""
