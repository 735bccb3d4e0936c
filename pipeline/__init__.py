"""3D motion from 2D motion: the methods and figures of four papers, on synthetic people and real motion capture.

The modules and packages, from the base upwards.  Each imports only from those above it in this list, which a test
checks.  The parts of `core` and `studies` are ordered by subject and have no import cycle::

    validation             InvalidInput: what, where, expected, found; the shared checks
    shortened              short representations of results
    reading                safe reading of the package's own files: regular, bounded, of an expected type
    skeleton               joints, world frame, units, conversion of source points to joints
    resources              files that are installed with the package
    plugins                additions by installed packages and users' files
    palette, tidy          colours and styles of series; rows of a table by series
    charts, scenes         content of figures, as plain values: charts of tables; views, postures and matrices
    chart_limits, chart_json    limits of the charts' axes; charts in the manifests of figures
    processes, locks       work on several processes that share the cores; locks between processes
    compilation            compiled loops: the only use of numba
    seeding                random generators

    core/                  the mathematics: pure functions on arrays
      fourier                periodic motion as a series                       zhang2007 3.1, 3.2, 3.4
      linear_model           average walker, eigenwalkers, leave-one-out       zhang2007 3.3
      camera                 orthographic projection                           zhang2007 3.5, 3.16, B.2, B.3
      reconstruction         coefficients from one known view                  zhang2007 3.6-3.15, A.1-A.5
      viewpoint              view angle and coefficients together              zhang2007 4.5, 4.6, B.1-B.3
      errors                 errors of a reconstruction                        zhang2007 4.1-4.4
      walking                steady walking, treadmill equivalent              zhang2007 section 2
      posture, aspace        postures as 37 numbers; their eigenvectors        mozerov2006 1-5
      synchronization        pairs of performances, the median sequence        mozerov2006 6-19
      action_model           mean performance and bounds of an action          mozerov2006 section 3, 4
      tracking               particle filter with the action model as prior
      pinhole, camera_paths  perspective cameras, still and moving             park2011 7
      articulation           intersections of rays and spheres                 park2011 8-11
      limb_chain             trees of limbs, their lengths                     park2011 1, 3, 6
      trajectory_basis       cosine basis, restricted to observed frames       park2011 2
      binary_quadratic       choice of candidates, with a certificate          park2011 12
      refinement             least reprojection error of the whole tree        park2011 4, 5
      articulated_trajectory a whole skeleton from the root to the leaves
      reconstructibility     how accurately a limb can be reconstructed        park2011 13-18
      rigid                  rigid motion of clusters of points
      likeness               test whether two recordings may show one person
      anthropometry, statistics, resampling    proportions; circular means, rank correlation; interpolation
      bootstrap              intervals of statistics over people
      newton, choice         minima inside brackets; selection that does not depend on rounding

    formats/               one reader for each file format
    mappings/              mappings of source points to joints: shipped, the user's own, the best fit
    fetch/                 downloading the public recordings
    storage/               store, sealed folders, provenance, archive, tables
    pictures/ recordings/  the only use of matplotlib; the only use of rerun
    papers/                the papers as data: equations, claims, the rule of verdicts

    synthetic/             synthetic people: walkers, bending, limbs
    clips/                 types of clips, without a reader: walks, performances, varied motion; their usable parts
    ingestion/             data sets and their recordings: the only package that uses formats, mappings and fetch
    api                    the library: read, joints, represent, fit, from_view, motion, tables
    studies/               options, dataset, model, sweeps, figures and measures of each study
      study, experiment      base classes of the options; the experiment that a preset composes
      figure_inputs          inputs of a figure: experiment, clips, results of the stages
      eigenwalkers/          Fourier samples of walks and models of them, for several studies
      occlusion              joints hidden from a camera, for several studies
      walks/                 zhang2004, zhang2007
      actions/               mozerov2006
      limbs/                 park2011
      registry               the list of studies
      rows, measures         rows of published tables; functions of them
      evaluation, ledger     measures by name; verdicts on the papers' claims
      interventions          runs that test explanations of the ledger
      replicated             tables with people resampled, or of several populations
      published              published numbers and the tables that quote them
    stages/                ingest, dataset, model, sweep, figure; further populations, the one shown
    report/                the page over all figures, with players that compute in the browser; the only use of jinja2
    cli/                   composing options (the only use of Hydra), commands, progress, summary
    __main__               python -m pipeline

Conventions: millimetres, seconds, hertz, radians; degrees only in options, tables and recordings, with the unit in
the name.  Arrays are ordered (walker, harmonic or frame, joint, space).  World: right-handed, z up, the walk along
+y, +x to the walker's right; view angle 0 is the frontal view, -90 degrees the left profile; image right is then the
walker's right, so a video taken from the front has to be mirrored.

Input that cannot be used raises `InvalidInput`.
"""

from __future__ import annotations

TYPE_CHECKING = False  # importing typing takes so long that Ctrl-C during it would print a traceback
if TYPE_CHECKING:
    from typing import Any

    from pipeline.api import fit, from_view, joints, motion, read, represent, to_dataframe, to_xarray
    from pipeline.validation import InvalidInput

    __version__: str

__all__ = [
    "InvalidInput", "__version__", "fit", "from_view", "joints", "motion", "read", "represent", "to_dataframe",
    "to_xarray",
]  # fmt: skip


def __getattr__(name: str) -> Any:
    """Return a function of `pipeline.api`, which is imported when a function is first used."""
    import importlib

    if name == "__version__":
        return importlib.import_module("pipeline.resources").version()
    if name in __all__:
        return getattr(importlib.import_module("pipeline.api"), name)
    raise AttributeError(f"module 'pipeline' has no attribute {name!r}")
