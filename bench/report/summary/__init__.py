"""summary.txt, a module a section; `page` puts them together."""
