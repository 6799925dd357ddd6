"""The synthetic rig: records sessions with known truth. Its physics is not the estimator's.

A protocol (protocol, protocol_tables) names whisker, object, motor, gauges and cameras; simulation makes the
session's folders from it (parts), and build its bodies.

Mechanics of a trial (recording): an object (touched_object; bar, round_objects) is placed, and first touch
found. stroke is the motor's motion; stick_slip marches along it, from one equilibrium of rod_contact to
the next under a law of friction_laws. The rod bends in a plane (planar_rod, elastica) or in space
(kirchhoff_rod). whisk_mechanics holds the states of one whisk.

Signals: loading has the moments at the base over time, vibration what rings on top; strain_gauges,
force_sensor and contact_microphone make of them what is recorded.

Pictures: exposure_instants says where the whisker is while a frame is exposed; a studio is one camera before
a painted_scene, whose things are a tube (wire, bar), a plate (board, marker), a box (hub) or a solid (ring
in torus, sphere and cone in quadrics), drawn as a layer in the fine samples of a window. sensor makes grey
levels of it.

Truth: truth_files, of the same states. Text files of the session: session_files.
"""
