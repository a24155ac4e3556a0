"""Attacks and mistakes of machines and files, and the required results."""
