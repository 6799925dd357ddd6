"""A bench to be planned, in memory: a whisk staged, two cameras, lines worth what lines are."""

import numpy as np

from bench.plan.planned_cameras import as_seen_camera
from bench.plan.staged import StagedWhisk, stage_run
from bench.rig import build
from bench.rig.protocol import Protocol, load
from tests.scenes.rig_sessions import protocol_file
from vision.fit.line_noise import LineNoise
from vision.geometry.camera import Cameras

TWO_CAMERAS = """
[[cameras]]
name = "high"
position_mm = [38.0, -175.0, 335.0]
[[cameras]]
name = "low"
position_mm = [98.0, -325.0, 120.0]
"""
BENCH = f'name = "bench"{TWO_CAMERAS}[[trials]]\nbeta_deg = 30\n'
LINES = LineNoise(0.03, 0.2, np.array([[0.0, 0.06, 0.08]]))


def protocol_of(folder, text: str = BENCH) -> Protocol:
    """A protocol from its text."""
    return load(protocol_file(folder, text))


def staged_of(protocol: Protocol) -> StagedWhisk:
    """Its first trial."""
    return stage_run(protocol.runs()[0])


def cameras_of(protocol: Protocol) -> Cameras:
    """Its cameras, exact."""
    return Cameras(tuple(as_seen_camera(camera) for camera in build.cameras(protocol)))
