"""The page over all figures of a data set: one file that a person opens, plays with, sends and prints.

`write_page` reads the published folders of ``results/<data>/<scale>`` and writes ``index.html`` beside them: papers and
verdicts, figure by figure, and three players that compute in the browser.  Nothing is fetched when it is opened.
`compare_variants` puts the variants of a multirun side by side.  `keep_light` writes the page into an archive that is
small enough for the repository, with tables, pictures and metadata.  `draw_first_screen` draws what the README begins
with.
"""

from pipeline.report.document import PAGE, write_page
from pipeline.report.first_screen import draw_first_screen
from pipeline.report.light import keep_light
from pipeline.report.published import Published, read_published
from pipeline.report.variants import compare_variants, shown_variants

__all__ = [
    "PAGE",
    "Published",
    "compare_variants",
    "draw_first_screen",
    "keep_light",
    "read_published",
    "shown_variants",
    "write_page",
]
