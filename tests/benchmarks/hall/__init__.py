"""An invented hall with robots that take chance times, fall silent and stop, to measure rules by which starts are given to robots."""
