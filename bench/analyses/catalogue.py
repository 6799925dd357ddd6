"""All analyses of a run, in the order in which the summary names their files."""

from bench.analyses.against_theta import AgainstTheta
from bench.analyses.analysis import Analysis
from bench.analyses.back_strokes import BothWays
from bench.analyses.base_moments import BaseMoments
from bench.analyses.continuous_profile import ContinuousProfile
from bench.analyses.curved import Curvature
from bench.analyses.error_against_slope import ErrorAgainstFriction, ErrorAgainstSlope
from bench.analyses.error_map import ErrorMap
from bench.analyses.explained import Explained
from bench.analyses.figure_8 import Figure8
from bench.analyses.friction_tables import FrictionAngles
from bench.analyses.gave import GivesWay
from bench.analyses.known_friction import KnownFriction
from bench.analyses.ledger import Ledger
from bench.analyses.microphone import Microphone
from bench.analyses.moving_objects import MovingObjects
from bench.analyses.reorientation import Reorientation
from bench.analyses.single_camera import OneCamera
from bench.analyses.soft import Softness
from bench.analyses.stage_and_felt import StageAndFelt
from bench.analyses.stage_and_pictures import StageAndPictures
from bench.analyses.table_i_sensors import Sensors
from bench.analyses.tilted import Tilts

ANALYSES: tuple[Analysis, ...] = (
    FrictionAngles(),
    KnownFriction(),
    Figure8(),
    ErrorAgainstSlope(),
    ErrorAgainstFriction(),
    Explained(),
    ErrorMap(),
    AgainstTheta(),
    Softness(),
    GivesWay(),
    BaseMoments(),
    Curvature(),
    Tilts(),
    Reorientation(),
    ContinuousProfile(),
    Sensors(),
    Microphone(),
    MovingObjects(),
    BothWays(),
    OneCamera(),
    StageAndPictures(),
    StageAndFelt(),
    Ledger(),
)
