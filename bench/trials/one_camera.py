"""Distance, force and give by the shape that one camera shows of a whisk, without gauges
(`estimator.seen_shape`).

It uses pictures of its own trial, as no other estimate does: its rows have a table and a line of
their own (`one_camera.csv`).
"""

from bench.base.errors import BadInput
from bench.base.settings import OBJECT_REACH_MM, TILT_SIGMA_RAD, Settings
from bench.base.statuses import reason
from bench.records.trial_result import ByOneCamera
from bench.session.session import Session
from bench.session.whisker import Whisker
from estimator.seen_shape import SeenShape, contact_of_shape
from vision import Value, WhiskTruth, sights_of

NOT_SHOWN = reason("wire_not_shown")


def require_camera(session: Session, settings: Settings) -> None:
    """Raise BadInput where the one camera of the settings took no pictures."""
    asked = settings.one_camera
    names = sorted({name for trial in session.trials for name in trial.camera_sources})
    if asked is not None and asked not in names:
        found = f"cameras are {', '.join(names)}" if names else "no trial has pictures"
        raise BadInput(f"--one-camera {asked}: {found}")


def by_one_camera(truth: WhiskTruth, whisker: Whisker, settings: Settings) -> ByOneCamera | None:
    """Return the contact by the camera that the settings ask for; None where they ask for none."""
    camera = settings.one_camera
    if camera is None:
        return None
    if truth.problem is None:
        return ByOneCamera(camera, status=truth.status)
    sights = sights_of(truth.problem, camera)
    if sights is None:
        return ByOneCamera(camera, status=NOT_SHOWN)
    found = contact_of_shape(
        SeenShape(
            sights.motor_rad,
            sights.frame,
            sights.eye_mm,
            sights.sight,
            sights.across,
            sights.sigma_rad,
            sights.shared_rad,
        ),
        settings.theta_rad,
        whisker.beam,
        reach_mm=OBJECT_REACH_MM,
        tilt_sigma_rad=TILT_SIGMA_RAD,
        rigidity_share=whisker.C_sigma_Nmm2 / whisker.C_Nmm2,
    )
    return ByOneCamera(
        camera,
        touch_rad=Value(found.touch_rad, found.touch_sigma_rad),
        d_x_mm=Value(found.d_x_mm, found.d_x_sigma_mm),
        force_N=Value(found.force_N, found.force_sigma_N),
        moved_mm=Value(found.moved_mm, found.moved_sigma_mm),
        stiffness_N_mm=found.stiffness_N_mm,
        stiffness_sigma_N_mm=found.stiffness_sigma_N_mm,
        stiffness_low_N_mm=found.stiffness_low_N_mm,
        status=found.status,
    )
