"""Report page with all figures of a data set, written as a single HTML file.

`document.write_page` reads the published folders of ``results/<data>/<scale>`` and writes ``index.html`` next to them:
papers, verdicts, figures, and three players that compute in the browser.  The page loads nothing from elsewhere.
`variants.compare_variants` compares the variants of a multirun.  `light.keep_light` writes an archive with page,
tables, pictures and metadata that is small enough for the repository.  `first_screen.draw_first_screen` draws the
pictures at the top of the README.
"""
