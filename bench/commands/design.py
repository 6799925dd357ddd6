"""The verb `design`: the best whisker for a region (bench/theory/best_design.py)."""

import argparse

from bench.base.errors import BadInput
from bench.base.exit_codes import DONE
from bench.base.progress import begin_step
from bench.commands.options import Verbs, add_out, add_verb

Range = tuple[float, float]

# What may be chosen, each: range where none is given (None: of a length it is the region's), what is
# allowed, what it is.
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
# What is to be felt, each: the range that is allowed, what it is.
_REGION = {
    "beta_deg": ((-80.0, 80.0), "slopes of what is to be felt"),
    "alpha_deg": ((0.0, 60.0), "its friction angles"),
    "d_x_mm": ((1.0, 5000.0), "distances of contact"),
}
# What the bench has, each: its default, what it is. All must be positive; a sigma may be 0.
_EQUIPMENT = {
    "bar_diameter_mm": (6.0, "of a round object that is felt"),
    "youngs_modulus_GPa": (60.0, "of the wire"),
    "most_strain_percent": (0.5, "that the wire bears and stays elastic"),
    "noise_Nmm": (0.07, "of one sample of a moment, one sigma"),
    "full_scale_Nmm": (110.0, "of the gauges"),
    "rate_Hz": (2000.0, "of their samples"),
    "speed_deg_s": (10.0, "of the motor"),
    "length_sigma_mm": (0.5, "one sigma of the whisker's length, by a ruler"),
    "diameter_sigma_mm": (0.02, "one sigma of each end's diameter, by a caliper, where it tapers"),
}
# [1] Lengths that are tried where none is given, over the farthest distance. Stated.
_LENGTHS = (1.05, 3.0)


def add(verbs: Verbs) -> None:
    """Add the verb."""
    verb = add_verb(
        verbs,
        "design",
        run,
        "pushing angle, whisker and tilt of the base that make the worst error of (10) over a region least",
        "whisker-bench design --beta-deg 20 60 --alpha-deg 5 15 --d-x-mm 30 80 --out design-out",
    )
    for name, (_, what) in _REGION.items():
        verb.add_argument(
            _option(name), type=float, nargs=2, required=True, metavar=("LOW", "HIGH"), help=what
        )
    for name, (usual, _, what) in _CHOICES.items():
        default = f" (default: {usual[0]:g} to {usual[1]:g})" if usual else ""
        help_text = f"{what}: one value, or two ends{default}"
        verb.add_argument(_option(name), type=float, nargs="+", metavar="X", help=help_text)
    equipment = verb.add_argument_group("what the bench has")
    for name, (default, what) in _EQUIPMENT.items():
        help_text = f"{what} (default {default:g})"
        equipment.add_argument(
            _option(name), type=float, default=default, metavar="X", help=help_text
        )
    add_out(verb, "OUT", "folder for design.txt, design.csv, design.png and .svg")


def run(options: argparse.Namespace) -> int:
    """Find the design, write it and print it; return the exit code.

    Raise BadInput for an option out of range.
    """
    region_ends = {name: _ends(options, name, allowed) for name, (allowed, _) in _REGION.items()}
    ranges = _ranges_to_search(options, region_ends["d_x_mm"][1])
    for name in _EQUIPMENT:
        value = getattr(options, name)
        is_exact = value == 0 and "sigma" in name
        if not (0 < value < float("inf") or is_exact):
            raise BadInput(f"{_option(name)} {value:g}: must be positive and finite")
    begin_step("the best design over the region")
    from bench.theory.best_design import DesignJob, Equipment, Region
    from bench.theory.design_map import find_design, report_lines, write_design

    region = Region(**region_ends, bar_radius_mm=0.5 * options.bar_diameter_mm)
    equipment = Equipment(
        options.youngs_modulus_GPa,
        options.most_strain_percent / 100,
        options.noise_Nmm,
        options.full_scale_Nmm,
        options.rate_Hz,
        options.speed_deg_s,
        options.length_sigma_mm,
        options.diameter_sigma_mm,
    )
    report = find_design(ranges, DesignJob(region, equipment))
    print(*report_lines(report), *write_design(options.out, report), sep="\n")
    return DONE


def _ranges_to_search(options: argparse.Namespace, farthest_mm: float) -> dict[str, Range]:
    """Return the range of each of _CHOICES: as given, else the usual one."""
    ranges = {}
    for name, (usual, allowed, _) in _CHOICES.items():
        if getattr(options, name):
            ranges[name] = _ends(options, name, allowed)
        elif usual:
            ranges[name] = usual
        else:
            ranges[name] = (_LENGTHS[0] * farthest_mm, _LENGTHS[1] * farthest_mm)
    return ranges


def _ends(options: argparse.Namespace, name: str, allowed: Range) -> Range:
    """Return (low, high) of an option with one value or two. Raise BadInput where not allowed."""
    given = getattr(options, name)
    low = given[0]
    high = given[-1]
    if len(given) > 2 or not allowed[0] <= low <= high <= allowed[1]:
        values = " ".join(f"{value:g}" for value in given)
        raise BadInput(
            f"{_option(name)} {values}: give a low and a high end, or one value, from {allowed[0]:g} to {allowed[1]:g}"
        )
    return low, high


def _option(name: str) -> str:
    """Return the option that sets a parameter of this name."""
    return "--" + name.replace("_", "-")
