"""Simulated fleets: each stands above robots that are simulated as well, and hands them its orders."""
