"""The page over all figures of a data set: one file that a person opens, plays with, sends and prints.

`document.write_page` reads the published folders of ``results/<data>/<scale>`` and writes ``index.html`` beside them:
papers and verdicts, figure by figure, and three players that compute in the browser.  Nothing is fetched when it is
opened.  `variants.compare_variants` puts the variants of a multirun side by side.  `light.keep_light` writes the page
into an archive that is small enough for the repository, with tables, pictures and metadata.
`first_screen.draw_first_screen` draws what the README begins with.  `walk_page` is the page of one walk from
keypoints; it needs nothing of the figures, so each module is imported by its own name.
"""
