"""AMR Scheduler as it is installed: the checkout's main.py, app, kv, locale and mir_sim lie unchanged in this folder."""
