"""summary.txt, a module a section; `compose` puts them together."""
