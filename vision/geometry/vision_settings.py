"""One object that carries every knob of seeing: how hard to look, and what is believed beforehand."""

from dataclasses import dataclass


@dataclass(frozen=True)
class VisionSettings:
    """How a trial is looked at.

    wire_piece_px, bar_piece_px: length of the pieces of which each gives one line point. wire_margin_px,
    bar_margin_px: background read on either side of the rod. rounds: how often the lines are traced anew from the
    fit. clock_sigma_s: how well the cameras' clock is known against the motor's; 0 takes frame times as exact.
    bar_reach_mm: length of bar used on either side of the contact. picture_scale: pictures are shrunk by so much, a
    whole number. every_frame: of a stroke's frames one in so many is looked at, all where these leave too few before
    touch. check_beam: whether the wire is fitted once more as a curve that is no beam, and looked at for another width,
    to see whether it is the one that is stated.
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
