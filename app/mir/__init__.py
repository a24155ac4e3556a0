"""The robot client: everything the app knows about a MiR robot's REST API v2.0.0, and nothing else."""
