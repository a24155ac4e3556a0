"""Of all tests: no example is too slow, however busy the machine."""
from hypothesis import settings

settings.register_profile("patient", deadline=None)
settings.load_profile("patient")
