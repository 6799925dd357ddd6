"""Results of whisks with a known friction, (13) and (14) exactly, seen and felt."""

import numpy as np

from bench.analyses import direction
from bench.analyses.analysis import EvaluatedRun
from bench.analyses.friction_tables import friction_of
from bench.base.results import plain
from bench.base.settings import Settings
from bench.records.plain import from_plain
from bench.records.trial_result import TrialResult, WhiskerFacts
from bench.session.whisker import Whisker
from estimator import slip
from estimator.distance import with_friction

WHISKER = Whisker(shape="cylinder", length_mm=100.0, diameter_mm=1.0, youngs_modulus_GPa=60.0)
C, THETA, ALPHA = WHISKER.C_Nmm2, np.radians(3.0), np.radians(14.0)
WHISKER_FACTS = WhiskerFacts("cylinder", 100.0, 1.0, WHISKER.EI_Nmm2)
# A whisk whose only frame is one before touch.
FREE_FRAME = {
    name: [np.nan] for name in ("index", "time_s", "motor_rad", "theta_rad", "arc_mm", "slip_mm")
} | {
    **{"touching": [False], "status": [""], "point_mm": [[np.nan] * 3], "slip_sigma_mm": [np.nan]},
    **{name: [np.nan] for name in ("d_y_mm", "d_z_mm", "alpha_rad", "alpha_sigma_rad")},
}
PHI_SIGMA = np.radians(0.3)


def run_of(*results: TrialResult, session=None) -> EvaluatedRun:
    """Return a run of these results, with α_est = 10°."""
    settings = Settings()
    return EvaluatedRun(
        whisker=WHISKER,
        settings=settings,
        results=results,
        friction=tuple(friction_of(results, WHISKER, settings.alpha_est_rad)),
        alpha_est_sigma_rad=np.radians(5.0),
        session=session,
    )


def deflection(d_x, beta):
    """Of a whisker that slides, frame by frame, small angles but for the way that the force turns."""
    theta = np.radians([1.0, 2.0, 3.0, 4.0])
    phi = slip.slip_angle(beta, ALPHA)
    size = d_x * theta * np.cos(beta) / np.cos(beta - phi)
    slid = size * np.sin(phi) / max(np.cos(beta), 1e-9)
    if phi != 0:
        phi = np.sign(beta) * direction.slip_angle(theta, abs(beta), np.full(4, ALPHA))
    y, z = size * np.cos(phi), size * np.sin(phi)
    rows = {"theta_rad": theta, "slip_mm": slid, "across_y_mm": y, "across_z_mm": z}
    rows |= {"motor_rad": theta, "along_mm": np.full(4, d_x), "past_mm": np.zeros(4)}
    rows |= {"slip_sigma_mm": np.zeros(4), "touch_rad": 0.0, "touch_sigma_rad": 1e-4, "d_x_mm": d_x}
    return rows | {"covariance": 1e-6 * np.eye(12), "by_camera_error_mm": np.zeros((12, 0))}


def result(beta_deg, d_x=60.0, *, alpha=ALPHA, name=None, nominal_mm=60.0) -> TrialResult:
    """One whisk, (13) and (14) exactly, seen and felt; the slip angle felt is the force's as the whisker bends."""
    beta = np.radians(beta_deg)
    m_y, m_z = slip.moments(d_x, THETA, beta, alpha, C)
    felt = {
        "m_y_Nmm": m_y,
        "m_z_Nmm": m_z,
        "m_y_sigma_Nmm": 0.02,
        "m_z_sigma_Nmm": 0.02,
        "touch_felt_rad": 0.0,
    }
    felt |= {"touch_felt_sigma_rad": 1e-4, "theta_sigma_rad": 1e-4}
    phi = np.arctan2(m_y, m_z)
    if phi != 0:
        across = np.array([abs(beta) - abs(phi)])
        phi = np.copysign(direction.slip_angle(np.array([THETA]), abs(beta), across)[0], phi)
    felt |= {
        "phi_felt_rad": phi,
        "phi_felt_sigma_rad": PHI_SIGMA,
        "one_factor": [],
        "status": "",
    }
    felt |= {"covariance_at": 4e-4 * np.eye(2), "theta_moment_covariance_at": np.zeros(2)}
    felt |= {"shared_Nmm": np.zeros((1, 2))}
    given = {
        "estimator": "with_friction",
        "alpha_est_rad": np.radians(10.0),
        "d_x_est_sigma_mm": 0.1,
        "status": "",
    }
    given |= {
        "d_x_est_mm": with_friction(THETA, m_y, m_z, np.radians(10.0), C),
        "beta_est_rad": 0.0,
    }
    truth = {
        "whisk": 0,
        "d_x_mm": d_x,
        "d_x_sigma_mm": 0.01,
        "beta_rad": beta,
        "beta_sigma_rad": np.radians(0.1),
    }
    truth["frames"] = FREE_FRAME
    seen = {"truth": truth, "deflection": deflection(d_x, beta), "status": ""}
    if abs(beta) > ALPHA:
        seen |= {"friction_rad": ALPHA, "friction_sigma_rad": np.radians(0.1)}
    trial = {
        "name": name or f"b{beta_deg:g}",
        "surface": "steel",
        "speed_deg_s": 10.0,
        "purpose": "measure",
    }
    trial |= {"beta_nominal_deg": beta_deg, "beta_nominal_sigma_rad": np.radians(3.0)}
    trial |= {"d_x_nominal_mm": nominal_mm}
    whole = {
        "trial": trial,
        "whisker": vars(WHISKER_FACTS),
        "theta_deg": 3.0,
        "seen": {"whisks": [seen]},
    }
    return from_plain(
        TrialResult, plain(whole | {"felt": {"whisks": [felt | {"estimates": [given]}]}})
    )
