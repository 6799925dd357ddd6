"""The fit's parameters: named blocks of one vector, each with its prior and its step of
differences.

All parameters are counted from what was found or stated beforehand, so that every prior has mean 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vision.geometry.touched import Touched
from vision.wire.points import SHARED

# [mm, rad] Of the bar from where it was found: nothing is believed of it, where nobody states its
# place. Stated.
BAR_PRIOR = np.array([50.0, 50.0, 1.0, 1.0])
# [mm] One sigma of what a lab's whisker may have at its tip: clamped off centre; encoder zero and
# clamp angle; set and sag; change of curvature. Wide: they only keep what no picture shows from
# running away. Stated.
REST_PRIOR_MM = np.array([1.0, 8.0, 5.0, 2.0])
# [mm] Least sigma of the reach, where both diameters are stated as exact. Derived.
_LEAST_REACH_MM = 1e-6
# [rad] One sigma of a frame's bend, 17°: strokes push by less, so that it only keeps what no
# picture shows from running away. Stated.
BEND_PRIOR_RAD = 0.3
# [1] One sigma of friction along the whisker over the force across it: Coulomb's coefficients,
# less where the contact slips along the bar. Study: exactness.py.
PULL_PRIOR = 0.2
# [px] Offset of a wire's whole line beyond that by light and lens: shadows, reflections. With it
# the true wires of 65 path-traced views are most probable. Study: wire_scenes.py.
WIRE_OFFSET_PX = 0.08
# [px] Tilt of such a line, at its ends: the RMS of 72 views (docs/ladder.md). Study: wire_scenes.py.
WIRE_TILT_PX = 0.09
# [px] As the whisker swings before light and background its offset changes a little, at its ends
# and in the middle: 0.020 to 0.034 px in path-traced views, 0.012 to 0.021 in painted ones
# (docs/ladder.md). Besides, what moves a line by so much moves it by as much over a radian of the
# swing. Study: no script.
WIRE_DRIFT_PX = 0.02
# [px] Sigmas of the six shapes of `problem.wire_modes`, in their order. A layout of those above.
WIRE_MODES_PX = np.array([WIRE_OFFSET_PX, WIRE_TILT_PX, *[WIRE_DRIFT_PX] * 4])
# [parameters] Of a camera's lines of the wire. A layout, no threshold.
WIRE_OFFSETS = len(WIRE_MODES_PX) + SHARED
# [px] Offset of a bar's whole line beyond its own sigma, where the line comes without an error that
# its points share (points drawn in studies). Study: bar_scenes.py.
BAR_OFFSET_PX = 0.05
# [px] Tilt of such a line, over `BAR_TILT_ARM_MM`. Study: bar_scenes.py.
BAR_TILT_PX = 0.025
# [px] Sigmas of a bar's line, in the order of the parameters. A layout of those above.
BAR_MODES_PX = np.array([BAR_OFFSET_PX, BAR_TILT_PX])

# [mm] Step of differences, about 1e-5 of what a length moves. Study: gradients.py.
_STEP_MM = 1e-4
# [rad] Step of differences of a tilt of the bar. Study: gradients.py.
_STEP_TILT_RAD = 1e-6
# [rad] Step of differences of a bend. Study: gradients.py.
_STEP_BEND_RAD = 1e-5
# [1/mm] Step of differences of the taper: of 100 mm a ten-thousandth of the diameter. Derived.
_STEP_TAPER_PER_MM = 1e-6
# [1] Step of differences of the friction. Study: gradients.py.
_STEP_FRICTION = 1e-3


@dataclass(frozen=True, eq=False)
class Block:
    """Neighbouring parameters of the fit that mean one thing.

    start: index of the first of them in the parameter vector. sigma (k,): standard deviations of
    their prior. step: by which they are moved for finite differences, one for all or (k,); 0 where
    derivatives are known without.
    """

    start: int
    sigma: np.ndarray
    step: float | np.ndarray = 0.0

    def __len__(self) -> int:
        """Return the number of parameters."""
        return len(self.sigma)

    @property
    def slice(self) -> slice:
        """Return the place of the parameters in the vector."""
        return slice(self.start, self.start + len(self))


@dataclass(frozen=True, eq=False)
class Blocks:
    """All blocks of the parameter vector, in its order; a block of no parameters is one that the
    whisk has no need of.

    bar_axis: two shifts in mm and two tilts in rad across the bar's axis. rest_shape: mm at the
    tip, four powers in y, then in z. reach: error of the distance from axis to centreline at the
    contact, mm. taper: error of the share of its diameter that a whisker loses for each mm, of one that
    tapers. wire_offsets, bar_offsets: by camera, px by which its lines of wire and bar are off
    as a whole (of the wire the shapes of `wire_modes`, then what its points share). motion: of a
    bar that does not stand still. shift_along: of the object along its axis, mm. outline_bias: by
    camera, px by which the object's outline is read too far out. friction: along the whisker, over
    the force across it. bends: rad, two of each frame that may bend. in_order: all of these.
    """

    bar_axis: Block
    rest_shape: Block
    reach: Block
    taper: Block
    wire_offsets: tuple[Block, ...]
    bar_offsets: tuple[Block, ...]
    motion: Block
    shift_along: Block
    outline_bias: Block
    friction: Block
    bends: Block
    in_order: Sequence[Block]

    @classmethod
    def laid_out(
        cls,
        *,
        reach_sigma_mm: float,
        taper_sigma_per_mm: float,
        offset_sigma_px: np.ndarray,
        motion_sigma: Sequence[float],
        touched: Touched,
        bent_frames: int,
        axis_sigma: np.ndarray = BAR_PRIOR,
    ) -> "Blocks":
        """Return the blocks one behind the other. offset_sigma_px (cameras, 12): see
        `WIRE_MODES_PX`, `BAR_MODES_PX`. axis_sigma (4,): of the object's axis, mm and rad.
        """
        layout = _Layout()
        axis_step = np.repeat([_STEP_MM, _STEP_TILT_RAD], 2)
        bar_axis = layout.add(axis_sigma, axis_step)
        rest_shape = layout.add(np.tile(REST_PRIOR_MM, 2), _STEP_MM)
        reach = layout.add([max(reach_sigma_mm, _LEAST_REACH_MM)], _STEP_MM)
        taper = layout.add([taper_sigma_per_mm] if taper_sigma_per_mm else [], _STEP_TAPER_PER_MM)
        wire_offsets, bar_offsets = _add_line_offsets(layout, offset_sigma_px)
        outline_sigma = touched.outline_sigma_px * len(offset_sigma_px)
        return cls(
            bar_axis=bar_axis,
            rest_shape=rest_shape,
            reach=reach,
            taper=taper,
            wire_offsets=wire_offsets,
            bar_offsets=bar_offsets,
            motion=layout.add(motion_sigma, _STEP_MM),
            shift_along=layout.add(touched.along_sigma_mm, _STEP_MM),
            outline_bias=layout.add(outline_sigma, _STEP_MM),
            friction=layout.add([PULL_PRIOR], _STEP_FRICTION),
            bends=layout.add([BEND_PRIOR_RAD] * (2 * bent_frames), _STEP_BEND_RAD),
            in_order=layout.blocks,
        )

    @property
    def size(self) -> int:
        """Return the number of all parameters."""
        return self.bends.slice.stop

    @cached_property
    def prior_sigma(self) -> np.ndarray:
        """Return the prior's standard deviation (size,) of each parameter."""
        return np.concatenate([block.sigma for block in self.in_order])

    @cached_property
    def steps(self) -> np.ndarray:
        """Return the step (size,) of finite differences of each parameter."""
        return np.concatenate([np.broadcast_to(b.step, len(b)) for b in self.in_order])

    @property
    def geometry(self) -> np.ndarray:
        """Return the indices of what bends and places whisker and object, of no error of lines."""
        whisker = columns_of(self.bar_axis, self.rest_shape, self.friction, self.bends)
        return np.append(whisker, self.placement)

    @property
    def placement(self) -> np.ndarray:
        """Return the indices of what places the object besides its axis: motion, shift along it,
        outline bias.
        """
        return columns_of(self.motion, self.shift_along, self.outline_bias)


class _Layout:
    """The blocks laid out so far, one behind the other."""

    def __init__(self):
        """Start with no parameter."""
        self.blocks: list[Block] = []

    def add(self, sigma: Sequence[float], step: float | np.ndarray = 0.0) -> Block:
        """Return a block behind all others."""
        start = self.blocks[-1].slice.stop if self.blocks else 0
        block = Block(start, np.asarray(sigma, dtype=float), step)
        self.blocks.append(block)
        return block


def _add_line_offsets(
    layout: _Layout, sigma_px: np.ndarray
) -> tuple[tuple[Block, ...], tuple[Block, ...]]:
    """Add the blocks of each camera's lines of wire and bar, and return those of wires and of bars.

    sigma_px (cameras, 12): see `Blocks.laid_out`.
    """
    wires = []
    bars = []
    for own in sigma_px:
        wires.append(layout.add(own[:WIRE_OFFSETS]))
        bars.append(layout.add(own[WIRE_OFFSETS:]))
    return tuple(wires), tuple(bars)


def columns_of(*blocks: Block) -> np.ndarray:
    """Return the indices of all parameters of these blocks, block by block."""
    columns: list[int] = []
    for block in blocks:
        columns += range(block.start, block.slice.stop)
    return np.array(columns, dtype=int)
