"""The settings of everything that is measured in pictures."""

from dataclasses import dataclass


@dataclass(frozen=True)
class VisionSettings:
    """Settings with which the pictures of a trial are evaluated.

    wire_piece_px, bar_piece_px: length of the segments that give one line point each.
    wire_margin_px, bar_margin_px: background read on either side of the rod.
    rounds: how often the lines are traced anew from the fit.
    clock_sigma_s: uncertainty of the cameras' clock against the motor's; 0 takes frame times as
    exact. bar_reach_mm: length of bar used on either side of the contact.
    picture_scale: factor, a whole number, by which pictures are shrunk.
    every_frame: one in so many of a stroke's frames is evaluated; all where these leave too few
    before touch.
    check_beam: whether the wire is fitted again as a curve that is no beam and with another width,
    to check that it is the one that is stated.
    read_base: whether the whisker's base is read in all frames before touch, by which the rig is placed.
    measure_sizes: whether the wire's end and the widths of wire and bar are measured, which may contradict the
    stated ones.
    """

    wire_piece_px: int = 12
    bar_piece_px: int = 12
    wire_margin_px: int = 7
    bar_margin_px: int = 12
    rounds: int = 1
    clock_sigma_s: float = 0.0
    bar_reach_mm: float = 36.0
    picture_scale: int = 1
    every_frame: int = 1
    check_beam: bool = True
    read_base: bool = True
    measure_sizes: bool = True
