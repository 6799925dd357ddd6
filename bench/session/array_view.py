"""A session of several whiskers as one view a whisker: a session of that whisker alone, in its own base frame.

All conventions of one whisker hold in that frame: its origin is the base, its z the axis that the base turns about,
its x the whisker at motor angle 0. Every step of an evaluation can so take a view as it takes a session.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import numpy as np

from bench.base.doubts import Doubts
from bench.base.errors import BadInput
from bench.session import manifest
from bench.session.daq import Channel, DaqFile
from bench.session.session import (
    MANIFEST,
    Base,
    Session,
    given_gauges,
    loaded,
    read_manifest,
    stated_whisker,
)
from bench.session.signals import FORCES, MOMENTS, MOTOR, TIME, VOLTS
from bench.session.strict_toml import values
from bench.session.table import column_names
from bench.session.trial import Trial
from vision.geometry.rotation import compose

_PARALLEL = 1e-6  # rounding of cosines: axes of bases on one motor
_OWN = (*VOLTS, *MOMENTS, *FORCES)  # columns that no two whiskers share

_OWN_GAUGES = "give each of [[whiskers]] its own: [whiskers.gauges]"


def load_views(
    path: Path | str,
    doubts: Doubts | None = None,
    *,
    trials: Collection[str] | None = None,
    follow_links: bool = False,
) -> tuple[Session, ...]:
    """As `load_session`, a session a whisker: the one of [whisker] as it is, or a view for each of [[whiskers]].

    Raises BadInput, with [[whiskers]] also for names used twice, bases that touch, and whiskers that share a channel.
    """
    path, doubts = Path(path), doubts or Doubts()
    keys = read_manifest(path, doubts, follow_links)
    session = loaded(path, keys, doubts, trials=trials)
    if not keys.whiskers:
        return (session,)
    _check_tables(session, keys)
    named = {one.name: one for one in keys.whiskers}
    bases = [_base(one) for one in keys.whiskers]
    _check_names([one.name for one in keys.whiskers])
    _check_apart(bases, keys.whiskers)
    channels: dict[str, dict[str, DaqFile]] = {}
    for trial in session.trials:
        with doubts.guard():
            channels[trial.name] = _channels_of_all(trial, named)
            _check_motors(bases, channels[trial.name])
            _check_cone(bases, trial)
    if any(trial.camera_sources for trial in session.trials):
        _check_placed(session)
    readable = tuple(trial for trial in session.trials if trial.name in channels)
    return tuple(_view(session, named[base.name], base, readable, channels) for base in bases)


def _check_tables(session: Session, keys: manifest.SessionKeys) -> None:
    """What one whisker alone has. Raises BadInput."""
    if keys.whisker is not None:
        raise BadInput("has [whisker] and [[whiskers]]; keep one of them", file=MANIFEST)
    if keys.gauges is not None:
        raise BadInput(f"[gauges] are one whisker's; {_OWN_GAUGES}", file=MANIFEST)
    if session.gauges_toml is not None:
        raise BadInput(f"is one whisker's; {_OWN_GAUGES}", file="gauges.toml")


def _check_placed(session: Session) -> None:
    """Pictures of several wires do not tell where the bases stand. Raises BadInput."""
    if session.T_rig_board is None and session.cameras_toml is None:
        asked = "measure it, or bring cameras.toml: of several wires it says which is whose"
        raise BadInput(f"[rig] T_rig_board is missing; {asked}", file=MANIFEST)


def _check_names(names: Sequence[str]) -> None:
    """Raises BadInput for one that cannot name a folder, or that two have."""
    for number, name in enumerate(names):
        if name.startswith(".") or not all(c.isalnum() or c in "_.-" for c in name):
            raise BadInput(
                f"[[whiskers]] name {name!r}: letters, digits, '_', '-' and '.' are allowed",
                file=MANIFEST,
            )
        if name.casefold() in (other.casefold() for other in names[:number]):
            raise BadInput(f"[[whiskers]] name {name!r} is used twice", file=MANIFEST)


def _base(keys: manifest.ArrayWhiskerKeys) -> Base:
    """Where a whisker's base stands: turned about the rig's x, then y, then z, and shifted."""
    (cx, cy, cz), (sx, sy, sz) = (of(np.radians(keys.base_deg)) for of in (np.cos, np.sin))
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    pose = np.column_stack([about_z @ about_y @ about_x, keys.base_mm])
    return Base(keys.name, pose, keys.base_sigma_mm, float(np.radians(keys.base_sigma_deg)))


def _check_apart(bases: Sequence[Base], keys: Sequence[manifest.ArrayWhiskerKeys]) -> None:
    """Raises BadInput where two bases are nearer than both radii."""
    for (one, a), (other, b) in combinations(zip(bases, keys), 2):
        apart_mm = float(np.linalg.norm(one.T_rig_base[:, 3] - other.T_rig_base[:, 3]))
        radii_mm = 0.5 * (a.diameter_mm + b.diameter_mm)
        if apart_mm < radii_mm:
            found = f"the bases of {one.name} and {other.name} touch: {apart_mm:.3g} mm apart, radii {radii_mm:.3g} mm"
            raise BadInput(
                f"[[whiskers]] {found}; base_mm is each one's own, in the rig frame", file=MANIFEST
            )


def _channels_of_all(
    trial: Trial, whiskers: Mapping[str, manifest.ArrayWhiskerKeys]
) -> dict[str, DaqFile]:
    """Each whisker's channels of the trial's file. Raises BadInput where two whiskers share one."""
    found = {name: _channels(trial, keys) for name, keys in whiskers.items()}
    owners: dict[str, str] = {}
    for name, daq in found.items():
        for column in filter(daq.channels.get, _OWN):
            channel = daq.channels[column].channel
            if owner := owners.get(channel):
                twice = (
                    f"share the channel {channel!r}"
                    if owner != name
                    else f"has the channel {channel!r} twice"
                )
                whose = name if owner == name else f"{owner} and {name}"
                raise BadInput(
                    f"[[whiskers]] {whose} {twice}; [whiskers.channels] names each one's own",
                    file=MANIFEST,
                )
            owners[channel] = name
    return found


def _channels(trial: Trial, keys: manifest.ArrayWhiskerKeys) -> DaqFile:
    """A whisker's channels: as [whiskers.channels] names them; else those of [signals], or the columns that end in
    @ and its name."""
    named = {column: name for column, name in values(keys.channels).items() if name is not None}
    if trial.daq is not None:
        given = trial.daq.channels
        own = {
            column: replace(given.get(column, Channel("")), channel=name)
            for column, name in named.items()
        }
        return replace(trial.daq, channels=given | own)
    there = column_names(trial.signals_path, trial.shown(trial.signals_path.name))
    tagged = {column: f"{column}@{keys.name}" for column in (MOTOR, *_OWN)}
    columns = {column: name for column, name in tagged.items() if name in there} | named
    columns = {TIME: TIME, MOTOR: MOTOR} | columns
    if not any(column in columns for column in (*VOLTS, *MOMENTS)):
        columns |= {column: tagged[column] for column in VOLTS}
    return DaqFile(
        trial.signals_path.name, None, {column: Channel(name) for column, name in columns.items()}
    )


def _check_motors(bases: Sequence[Base], channels: Mapping[str, DaqFile]) -> None:
    """Raises BadInput where whiskers on one motor turn about axes that are not parallel."""
    for one, other in combinations(bases, 2):
        motors = [channels[base.name].channels[MOTOR] for base in (one, other)]
        cosine = one.T_rig_base[:, 2] @ other.T_rig_base[:, 2]
        if motors[0] == motors[1] and abs(cosine) < 1 - _PARALLEL:
            angle = np.degrees(np.arccos(cosine))
            found = f"{one.name} and {other.name} are on one motor ({motors[0].channel}), their axes {angle:.3g}° apart"
            raise BadInput(
                f"[[whiskers]] {found}; name each one's own motor_deg in [whiskers.channels]",
                file=MANIFEST,
            )


def _check_cone(bases: Sequence[Base], trial: Trial) -> None:
    """Raises BadInput for a cone that is said to end before it comes to any whisker's plane of whisking."""
    if trial.object is None or trial.object.shape != "cone" or trial.object.point_mm is None:
        return
    tip, axis = (
        np.array(given, dtype=float) for given in (trial.object.point_mm, trial.object.axis)
    )
    opening = np.radians(trial.object.half_angle_deg)
    for base in bases:
        normal = base.T_rig_base[:, 2]
        towards = np.copysign(1.0, (base.T_rig_base[:, 3] - tip) @ normal) * normal
        if (
            np.arccos(np.clip(-axis @ towards / np.linalg.norm(axis), -1.0, 1.0)) - opening
            < np.pi / 2
        ):
            return
    found = "the cone's tip, point_mm, lies before every whisker's plane: none can touch it; axis points to the tip"
    raise BadInput(f"[object] {found}", file=f"trials/{trial.name}/trial.toml")


def _view(session: Session, keys, base: Base, trials: Sequence[Trial], channels) -> Session:
    """The session as that whisker alone would have recorded it, in its base frame; the other wires are in its pictures,
    too."""
    own = tuple(
        replace(
            trial,
            daq=channels[trial.name][base.name],
            whisker=base.name,
            object_velocity_mm_s=_turned(trial.object_velocity_mm_s, base),
        )
        for trial in trials
    )
    return replace(
        session,
        name=f"{session.name}, whisker {base.name}",
        whisker=stated_whisker(keys, f"[[whiskers]] {base.name}:"),
        gauges=given_gauges(keys.gauges),
        trials=own,
        base=base,
        whole=session,
        T_rig_board=None
        if session.T_rig_board is None
        else compose(base.T_base_rig, session.T_rig_board),
        T_rig_board_sigma_mm=math.hypot(session.T_rig_board_sigma_mm, base.sigma_mm),
        T_rig_board_sigma_rad=math.hypot(session.T_rig_board_sigma_rad, base.sigma_rad),
    )


def _turned(in_rig: Sequence[float] | None, base: Base) -> list[float] | None:
    """A vector of the rig frame in a base's, where there is one."""
    return None if in_rig is None else (base.T_rig_base[:, :3].T @ in_rig).tolist()
