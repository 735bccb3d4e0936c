"""3D motion from 2D motion: four papers, figure by figure, on real motion capture.

The map of the house, from the ground up; a module imports only from lower layers (a test holds it)::

    0  refusal            bad input in one sentence
       skeleton           joints, world frame, units, how source points become joints
       papers*            the papers as data: equations with their homes, claims with their verdicts
    1  core/              the mathematics: pure functions on arrays
         frequency          the frequency of a walk                          zhang2007 3.1
         fourier            phase, harmonics, synthesis                      zhang2007 3.1-3.4
         linear_model       mean, components, leave-one-out                  zhang2007 3.3
         camera             how 3D becomes 2D                                zhang2007 3.5, 3.16, B.2, B.3
         reconstruction     coefficients from one known view                 zhang2007 3.6-3.15, A.1-A.5
         noise_path         its error for every sigma²                       zhang2007 3.15, 4.2
         viewpoint          view angle and coefficients together             zhang2007 4.5, 4.6, B.1-B.3
         view_search        the search over the angle behind it
         observation        what one view shows, its frequency from it alone
         observed_phase     one known view, the phase unknown too
         observed_viewpoint the view unknown as well
         errors, circular   how wrong it is                                  zhang2007 4.1-4.4
         usable_clip        units, sizes and gaps of a clip
         resampling         between samples, by linear interpolation
         walking            steady walking, treadmill equivalent             zhang2007 section 2
         synthetic …        the embedded population of walkers
         posture            37 numbers and back; limb_frames                 mozerov2006 1, 2
         aspace             postures by few eigenvectors                     mozerov2006 3-5
         synchronization    one pair of performances, linear and dense        mozerov2006 6-12, 14, 15, 18
         trellis            recurrence and backtracking                       mozerov2006 13, 16, 17
         all_pairs          all ordered pairs, the median sequence            mozerov2006 19
         key_frames         the manual comparison, by curvature
         action_model       mean performance, bounds, sampling
         learnt_action      all of it in one piece
         tracking           particle filter: particles, prediction, image_likelihood, tracking_error
         pinhole            perspective cameras                              park2011 7
         camera_paths       cameras that stand, walk around or shake
         rays, articulation ray meets sphere                                 park2011 8-11
         limb_chain         limbs that hang on each other                    park2011 1, 3, 6
         limb_lengths       from proportions, or from the rays
         hinges             knees and elbows flex one way
         trajectory_basis   cosines, restricted to what was seen             park2011 2
         binary_quadratic   which candidate, exact or certified              park2011 12
         sign_programme …   the searches behind it: sign_candidates, sign_search, box_search, suffix_search
         spherical          continuous angles                                park2011 4
         refinement         reprojection error of the whole tree             park2011 5
         reprojection …     what it is made of: limb_equations, refinement_input
         limb_choice        one limb, from its rays to its choice            park2011 12
         articulated        a whole skeleton from the root to the leaves
         mirror_search      mirrors that all limbs refined together prefer
         reconstructibility how well a limb can be known                     park2011 13-18
         rank_correlation   whether a measure tells which limbs err more
         synthetic_limbs    limbs with known answers
         bending …          synthetic performances; time_warps with known truth
    2  formats/           one reader to a file format, all return the same value
       store, archive     artefacts, publications; kept results; on sealed_folders, provenance
       tables             the only pandas
       recording*         the only rerun
       pictures*          the only matplotlib
       fetch*, threads    the public recordings; work over threads
    3  config             the options of every stage
       clips/             which recordings a data set names; walks, performances, varied motion out of them
       actions            an action learnt with the options of the model stage
       sweep_checks       options that several sweeps share, refused in one sentence
       limb_trials        cameras and bases of the experiments on limbs
       limb_scores        how wrong limbs are, and up to the mirror
       experiments/       what each kind of sweep measures
       figures/           what each kind of figure is made of
       ledger             the papers' claims against published tables
    4  stages/            ingest → dataset → model → sweep → report
    5  run, commands      one figure, many figures; everything else on the command line
       __main__           the only Hydra

Conventions: millimetres, seconds, hertz, radians; degrees only in configuration, tables and recordings, with
the unit in the name.  Arrays are ordered (walker, harmonic or frame, joint, space).  World: right-handed, z up,
the walk along +y, +x to the walker's right; view angle 0 is the frontal view, -90 degrees the left profile;
image right is then the walker's right, so a video taken from the front has to be mirrored.
"""
