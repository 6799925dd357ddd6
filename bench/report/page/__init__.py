"""OUT/report.html, methods.md and results.bib: one self-contained page, made from results alone.

`write` puts it together; a module a part: `plots` (figures), `cards` (a whisk), `scene` (the rig
in 3-D), `methods`. The templates, style and script beside them are package data.
"""
