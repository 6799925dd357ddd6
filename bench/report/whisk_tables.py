"""The tables of whisks that every evaluated session has: their columns."""

from bench.base.tables import (
    ANGLE_FROM,
    SPEED,
    SURFACE,
    TRIAL,
    TRUTH_SOURCE,
    WHISK,
    Column,
    Kind,
    Table,
    alike,
    shared_name,
    sigma_name,
    status,
    with_sigma,
)

PLACE = ("x_mm", "y_mm", "z_mm")
# Columns of whisks.csv of whose sigmas is stated what all whisks of a session have in common.
WITH_SHARED_SIGMA = ("touch_deg", "d_x_mm", "beta_deg", "psi_deg", "slip_mm", *PLACE)
_ON_CENTRELINE = "contact on the whisker's centreline, rig frame"
_AT_FIRST_TOUCH = "contact at first touch, rig frame"
_DEFLECTION = "deflection of the contact, in contact-frame axes, at θ"
_SPREAD = "standard deviation of their difference"

WHISKS = Table(
    "whisks",
    "A row a whisk. `d_x_mm` is empty exactly where there is no truth.",
    (
        TRIAL,
        WHISK,
        SURFACE,
        SPEED,
        Column("beta_nominal_deg", "nominal slope of the bar"),
        Column("theta_deg", "the pushing angle θ at which slip, moments and estimates are taken"),
        ANGLE_FROM,
        *with_sigma("touch_deg", "motor angle of first touch, seen"),
        *with_sigma("touch_felt_deg", "motor angle of first touch, felt"),
        *with_sigma("d_x_mm", "distance from the base to the contact at first touch: the truth"),
        TRUTH_SOURCE,
        *with_sigma(
            "beta_deg",
            "slope of the bar in the sensing plane, positive where it leans towards +y as z rises",
        ),
        *with_sigma("psi_deg", "tilt of the bar out of the sensing plane"),
        *with_sigma("slip_mm", "slip of the contact along the bar since touch, at θ"),
        *with_sigma(
            "longitudinal_slip_mm",
            "slip of the contact along the whisker: arc to the contact less d_x",
        ),
        *with_sigma("d_y_mm", _DEFLECTION),
        *with_sigma("d_z_mm", _DEFLECTION),
        *with_sigma("phi_seen_deg", "direction of the deflection, atan2(d_z, d_y)"),
        *with_sigma(
            "alpha_seen_deg", "friction angle along the bar, abs(β) − abs(φ), while slipping"
        ),
        *with_sigma("m_y_Nmm", "moments felt at θ, in the hub's axes"),
        *with_sigma("m_z_Nmm", "moments felt at θ, in the hub's axes"),
        *with_sigma("phi_felt_deg", "direction of the deflection as felt, atan2(m_y, m_z)"),
        *alike(
            map(shared_name, WITH_SHARED_SIGMA),
            "the part of a sigma that all whisks of the session share",
        ),
        *with_sigma("x_mm", _AT_FIRST_TOUCH),
        *with_sigma("y_mm", _AT_FIRST_TOUCH),
        *with_sigma("z_mm", _AT_FIRST_TOUCH),
        Column("cameras", "how many cameras the truth rests on", Kind.WHOLE),
        Column("frames_used", "how many of their frames the truth rests on", Kind.WHOLE),
        Column(
            "looked", "preset, or settings file, by which the pictures were looked at", Kind.TEXT
        ),
        status("warnings, seen and felt; or why there is nothing"),
    ),
)

ESTIMATES = Table(
    "estimates",
    "A row a whisk and estimator.",
    (
        TRIAL,
        WHISK,
        Column(
            "estimator",
            "no_slip (2), with_friction (10), frictionless (12), corrected ((10) less the first "
            "order of its error), exact_rod, with_friction_fitted and with_friction_seen (α fitted to the "
            "other whisks, or as seen), with_friction_kinetic (at the kinetic ends of teeth); with "
            "a load cell touch_alone, moment_rate, force_and_moment; or one's own",
            Kind.TEXT,
        ),
        Column("alpha_est_deg", "the friction angle that it assumed"),
        *with_sigma("d_x_est_mm", "distance estimated; the sigma holds what α_est may be off by"),
        Column("d_x_est_sigma_alpha_exact_mm", "its sigma as if α_est were right"),
        Column("d_x_est_low_mm", "low end of its 95 % interval; 0 is open"),
        Column("d_x_est_high_mm", "high end of its 95 % interval; the whisker's length is open"),
        Column("beta_est_deg", "slope estimated, where it gives one"),
        ANGLE_FROM,
        Column("error_mm", "estimate less truth"),
        TRUTH_SOURCE,
        Column("error_percent", "estimate less truth, % of the truth"),
        *with_sigma(
            "theta_c_deg",
            "angle of the contact felt, which is touch felt; its distance r_c is d_x_est",
        ),
        *with_sigma("z_c_mm", "height of the contact felt: of the plane of rotation"),
        Column(
            "r_theta_correlation",
            "of r_c and θ_c; empty where the estimator does not say; z_c errs on its own",
        ),
        Column(
            "point_error_mm",
            "from (r_c, θ_c, z_c) to the contact seen at first touch",
        ),
        *with_sigma("d_y_est_mm", "deflection of the contact by (18)"),
        Column("d_y_error_mm", "that less the deflection seen"),
        *with_sigma("d_z_est_mm", "deflection of the contact by (19)"),
        Column("d_z_error_mm", "that less the deflection seen"),
        *with_sigma("slip_est_mm", "slip by (5); empty where the estimator assumes no α"),
        Column("slip_error_mm", "that less the slip seen"),
        status("why there is none"),
    ),
)

TRACK = Table(
    "track/<trial>",
    "A row a frame of every whisk.",
    (
        Column("frame", "number of the frame in the trial", Kind.WHOLE),
        WHISK,
        Column("time_s", "time of the frame, on the signals' clock"),
        Column("motor_deg", "motor angle"),
        Column("theta_deg", "motor angle since touch"),
        Column("touching", "1 or 0", Kind.WHOLE),
        *alike(PLACE, _ON_CENTRELINE),
        Column("slip_mm", "slip along the bar since touch, in this frame"),
        *alike(
            map(sigma_name, (*PLACE, "slip_mm")),
            "standard deviations of the last four",
        ),
        *alike(("d_y_mm", "d_z_mm"), "deflection as in whisks.csv, in this frame"),
        Column("phi_seen_deg", "its direction, in this frame"),
        status("why there is none, or by how much the whisker slipped during the exposure"),
    ),
)

BUDGET = Table(
    "budget",
    "A row a whisk with truth: shares of d_x's variance, which add up to 100.",
    (
        TRIAL,
        WHISK,
        Column("d_x_sigma_mm", "as in whisks.csv"),
        Column("wire_percent", "scatter of the wire's line points"),
        Column("bar_percent", "scatter of the bar's line points"),
        Column("touch_percent", "roundness of bar and whisker"),
        Column(
            "diameters_percent", "the diameters' sigmas, and the length's of a whisker that tapers"
        ),
        Column("light_percent", "light that shifts a line as a whole"),
        Column("priors_percent", "priors of rest shape and bend"),
        Column("cameras_percent", "lenses, and poses towards the rig board"),
        Column(
            "placement_percent",
            "where the rig frame is; empty where the cameras' covariance does not hold it apart",
        ),
    ),
)

BEAM = Table(
    "beam",
    "A row a whisk with truth: results by a beam with a point load, and by a spline.",
    (
        TRIAL,
        WHISK,
        Column("theta_deg", "the largest pushing angle, where slip is compared"),
        Column("d_x_beam_mm", "d_x by the beam"),
        Column("d_x_spline_mm", "d_x by the spline"),
        Column("d_x_difference_sigma_mm", _SPREAD),
        Column("touch_beam_deg", "touch by the beam"),
        Column("touch_spline_deg", "touch by the spline"),
        Column("touch_difference_sigma_deg", _SPREAD),
        Column("slip_beam_mm", "slip by the beam"),
        Column("slip_spline_mm", "slip by the spline"),
        Column("slip_difference_sigma_mm", _SPREAD),
        Column("chance", "of a spline this far from the beam where the wire is a beam"),
    ),
)
