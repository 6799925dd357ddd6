"""A whisk evaluated while it is recorded: its pictures in memory, one at a time (`whisk.py`).

May import all folders of vision but boards and calibration.

`bench` imports the names below from here (see `vision`).
"""

from vision.geometry.lazy_names import lazy_names

NAMES = {"whisk": ("FIRST_FRAMES", "LiveBench", "LiveWhisk")}
__getattr__ = lazy_names(__name__, NAMES)
