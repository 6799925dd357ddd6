"""The verb `design`. Parsing only."""

import argparse

from bench.base.errors import BadInput
from bench.commands.options import DONE, Verbs, add_out, add_verb

# Of what may be chosen: range where none is given (of a length it is the region's), what is allowed, and what it is.
_CHOICES = {
    "theta_deg": ((0.5, 10.0), (0.05, 25.0), "pushing angle"),
    "alpha_est_deg": ((0.0, 45.0), (0.0, 80.0), "friction angle that (10) assumes"),
    "diameter_mm": ((0.2, 2.0), (0.01, 30.0), "of the wire at its base"),
    "length_mm": (
        None,
        (1.0, 5000.0),
        "from base to tip (default: 1.05 to 3 times the farthest d_x)",
    ),
    "taper": (
        (0.0, 1.0),
        (0.0, 1.0),
        "share of the diameter that is lost up to the tip; 1 is a cone",
    ),
    "tilt_deg": ((-80.0, 80.0), (-80.0, 80.0), "of the plane of whisking about the whisker"),
}
_REGION = {
    "beta_deg": ((-80.0, 80.0), "slopes of what is to be felt"),
    "alpha_deg": ((0.0, 60.0), "its friction angles"),
    "d_x_mm": ((1.0, 5000.0), "distances of contact"),
}


def add_design(verbs: Verbs) -> None:
    """`design`."""
    verb = add_verb(
        verbs,
        "design",
        _design,
        "pushing angle, whisker and tilt of the base that make the worst error of (10) over a region least",
        "whisker-bench design --beta-deg 20 60 --alpha-deg 5 15 --d-x-mm 30 80 --out design-out",
    )
    for name, (_, what) in _REGION.items():
        verb.add_argument(
            _option(name), type=float, nargs=2, required=True, metavar=("LOW", "HIGH"), help=what
        )
    for name, (usual, _, what) in _CHOICES.items():
        said = f"{what}: one value, or two ends" + (
            f" (default: {usual[0]:g} to {usual[1]:g})" if usual else ""
        )
        verb.add_argument(_option(name), type=float, nargs="+", metavar="X", help=said)
    means = verb.add_argument_group("what the bench has")
    for name, default, what in (
        ("bar_diameter_mm", 6.0, "of a round object that is felt"),
        ("youngs_modulus_GPa", 60.0, "of the wire"),
        ("most_strain_percent", 0.5, "that the wire bears and stays elastic"),
        ("noise_Nmm", 0.07, "of one sample of a moment, one sigma"),
        ("full_scale_Nmm", 110.0, "of the gauges"),
        ("rate_Hz", 2000.0, "of their samples"),
        ("speed_deg_s", 10.0, "of the motor"),
    ):
        said = f"{what} (default {default:g})"
        means.add_argument(_option(name), type=float, default=default, metavar="X", help=said)
    add_out(verb, "OUT", "folder for design.txt, design.csv, design.png and .svg")


def _option(name: str) -> str:
    return "--" + name.replace("_", "-")


def _design(options: argparse.Namespace) -> int:
    region_ends = {name: _ends(options, name, allowed) for name, (allowed, _) in _REGION.items()}
    far = region_ends["d_x_mm"][1]
    ranges = {}
    for name, (usual, allowed, _) in _CHOICES.items():
        given = getattr(options, name)
        ranges[name] = _ends(options, name, allowed) if given else usual or (1.05 * far, 3.0 * far)
    for name in (
        "bar_diameter_mm",
        "youngs_modulus_GPa",
        "most_strain_percent",
        "noise_Nmm",
        "full_scale_Nmm",
        "rate_Hz",
        "speed_deg_s",
    ):
        if not 0 < getattr(options, name) < float("inf"):
            raise BadInput(
                f"{_option(name)} {getattr(options, name):g}: must be positive and finite"
            )
    from bench.theory.design import Equipment, Region
    from bench.theory.design_map import find_design, report_lines, write_design

    region = Region(**region_ends, bar_radius_mm=0.5 * options.bar_diameter_mm)
    equipment = Equipment(
        options.youngs_modulus_GPa,
        options.most_strain_percent / 100,
        options.noise_Nmm,
        options.full_scale_Nmm,
        options.rate_Hz,
        options.speed_deg_s,
    )
    report = find_design(ranges, region, equipment)
    print(*report_lines(report), *write_design(options.out, report), sep="\n")
    return DONE


def _ends(
    options: argparse.Namespace, name: str, allowed: tuple[float, float]
) -> tuple[float, float]:
    """(low, high) of an option that was given one value or two."""
    given = getattr(options, name)
    low, high = given[0], given[-1]
    if len(given) > 2 or not allowed[0] <= low <= high <= allowed[1]:
        shown = " ".join(f"{value:g}" for value in given)
        raise BadInput(
            f"{_option(name)} {shown}: give a low and a high end, or one value, from {allowed[0]:g} to {allowed[1]:g}"
        )
    return low, high
