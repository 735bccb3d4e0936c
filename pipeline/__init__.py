"""3D motion from 2D motion: four papers, figure by figure, on real motion capture.

The map, from the ground up; a module imports only from what stands above it here (a test holds it)::

    validation             InvalidInput: what, where, expected, received; the checks everyone shares
    skeleton               joints, world frame, units, how source points become joints
    palette, tidy          colours and looks of series; rows of a table by series
    threads, seeding       work over threads; generators of random numbers

    core/                  the mathematics: pure functions on arrays
      fourier                periodic motion as a series                       zhang2007 3.1, 3.2, 3.4
      linear_model           average walker, eigenwalkers, leave-one-out       zhang2007 3.3
      camera                 how 3D becomes 2D                                 zhang2007 3.5, 3.16, B.2, B.3
      reconstruction         coefficients from one known view                  zhang2007 3.6-3.15, A.1-A.5
      viewpoint              view angle and coefficients together              zhang2007 4.5, 4.6, B.1-B.3
      observation            what one view shows, its frequency from it alone
      errors                 how far a reconstruction is off                   zhang2007 4.1-4.4
      walking                steady walking, treadmill equivalent              zhang2007 section 2
      posture, aspace        37 numbers and back; by few eigenvectors          mozerov2006 1-5
      synchronization        pairs of performances, the median sequence        mozerov2006 6-19
      action_model           mean performance, bounds; an action in one piece  mozerov2006 section 3, 4
      tracking               particle filter with the action model as prior
      pinhole, camera_paths  perspective cameras, still and moving             park2011 7
      articulation           ray meets sphere                                  park2011 8-11
      limb_chain             limbs that hang on each other, their lengths      park2011 1, 3, 6
      trajectory_basis       cosines, restricted to what was seen              park2011 2
      binary_quadratic       which candidate, exact or certified               park2011 12
      refinement             reprojection error of the whole tree              park2011 4, 5
      articulated_trajectory a whole skeleton from the root to the leaves
      reconstructibility     how well a limb can be known                      park2011 13-18
      anthropometry, statistics, resampling    proportions; circular means, rank correlation; interpolation
      newton, choice         minima inside brackets; choices that rounding does not change

    formats/               one reader to a file format, all return the same value
    fetch/                 the public recordings, checked
    storage/               store, sealed folders, provenance, archive, tables
    pictures/ recordings/  the only matplotlib; the only rerun
    papers/                the papers as data: equations, claims, the rule of verdicts

    synthetic/             the embedded people: walkers, bending, limbs
    clips/                 which recordings a data set names; walks, performances, varied motion out of them
    studies/               what belongs together, by study: options, dataset, model, sweeps, figures, measures
      study, experiment      what a study consists of; one experiment, whole
      walks/                 zhang2004, zhang2007
      actions/               mozerov2006
      limbs/                 park2011
      face_off/              the one study that looks into others
      registry               the list of studies
      measures, ledger       named functions of published tables; the papers' claims against them
      published              published numbers and the README's tables made of them
    stages/                ingest, dataset, model, sweep, figure: generic, thin
    cli/                   composing options (the only Hydra), commands, progress, summary
    __main__               python -m pipeline

Conventions: millimetres, seconds, hertz, radians; degrees only in options, tables and recordings, with the unit in
the name.  Arrays are ordered (walker, harmonic or frame, joint, space).  World: right-handed, z up, the walk along
+y, +x to the walker's right; view angle 0 is the frontal view, -90 degrees the left profile; image right is then the
walker's right, so a video taken from the front has to be mirrored.
"""
