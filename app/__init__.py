"""AMR Scheduler: missions of MiR robots by time, by recurrence and by idleness."""

__version__ = "0.1.0"
NAME = "AMR Scheduler"
