"""OUT/report.html, methods.md and results.bib: one self-contained page, made from results alone.

`write` puts it together; a module a part: `drawings` (figures), `cards` (a whisk), `rig_in_3d`,
`gauge_tables`, `methods`. The templates, style and script in this folder are package data.
"""
