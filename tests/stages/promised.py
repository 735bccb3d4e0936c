"""What every figure leaves at smoke scale: the columns of its tables, the entities of its recording.

The columns of ``table.csv`` are those of the golden table; here stand those of the tables beside it.
"""

from __future__ import annotations

from pathlib import Path

GOLDEN = Path(__file__).resolve().parent.parent / "golden"

WALKERS = 12
"""Of the smoke scale."""

# --- zhang2004, zhang2007 -----------------------------------------------------------------------------------

SPECTRUM = {
    "table_harmonics": [
        "person", "walker", "harmonic", "variance_fraction", "residual_fraction", "frequency_hz",
        "legs_apart_periods",
    ],
}  # fmt: skip
SUMMARY = ["mean_mm2", "mean_mm2_low", "mean_mm2_high", "median_mm2", "worst_mm2"]
VIEW_ERRORS = {
    "table_walkers": [
        "person", "walker", "method", "absolute_error_mm2", "relative_error",
    ],
    "table_coefficients": [
        "person", "walker", "method", "coefficients_beyond", "own_coefficients_beyond", "views_far_beyond",
        "own_far_beyond",
    ],
    "table_people": [
        "person", "walker", "method", "view_angle_deg", "absolute_error_mm2", "rms_error_mm", "relative_error",
        "missing_variance_mm2", "absolute_error_mm2_sides_at_random", "missing_variance_mm2_sides_at_random",
    ],
    "table_summary": ["method", *SUMMARY],
    "table_joints": [
        "method", "joint", "absolute_error_mm2", "absolute_error_mm2_low", "absolute_error_mm2_high",
        "absolute_error_median_mm2", "absolute_error_worst_mm2",
    ],
}  # fmt: skip
VIEW_ANGLES = {
    "table_people": ["person", "walker", "method", "view_angle_deg", "error_deg", "failed"],
    "table_walkers": [
        "person", "walker", "method", "mean_error_deg", "absolute_angle_error_median_deg",
        "absolute_angle_error_max_deg", "failures", "runner_up_cost_ratio_min", "not_converged",
    ],
}  # fmt: skip
IDENTIFICATION = ["person", "walker", "method", "view_angle_deg", "among_view_angle_deg", "identified"]
PROMISED: dict[str, dict[str, list[str]]] = {
    "zhang2004_fig2": SPECTRUM,
    "zhang2004_fig3": {
        "table_demonstrations": [
            "person", "walker", "view_angle_deg", "rms_error_least_squares_mm", "rms_error_average_walker_mm",
            "rms_least_squares_from_average_walker_mm",
        ],
        "table_identification": IDENTIFICATION,
    },
    "zhang2004_fig4": VIEW_ERRORS,
    "zhang2004_fig5": VIEW_ANGLES,
    "zhang2007_fig2": SPECTRUM,
    "zhang2007_fig3": {
        "table_views": ["view_angle_deg", "sigma2_mm2", "absolute_error_mm2"],
        "table_people": ["person", "walker", "sigma2_mm2", "absolute_error_mm2"],
        "table_nested": ["person", "walker", "sigma2_mm2", "absolute_error_mm2"],
    },
    "zhang2007_fig4": {
        "table_demonstrations": [
            "person", "walker", "view_angle_deg", "rms_error_least_squares_mm", "rms_error_map_mm",
            "rms_between_methods_mm", "rms_error_average_walker_mm", "rms_least_squares_from_average_walker_mm",
            "rms_map_from_average_walker_mm",
        ],
        "table_identification": IDENTIFICATION,
    },
    "zhang2007_fig5": VIEW_ERRORS,
    "zhang2007_fig6": VIEW_ANGLES | {"table_published": VIEW_ANGLES["table_people"]},
    "zhang2007_joint_angles": {
        "table_walkers": ["method", "angle", "person", "walker", "rmse_deg", "offset_free_rmse_deg"],
        "table_summary": [
            "method", "angle", "walkers",
            *(f"{e}{suffix}" for e in ("rmse", "offset_free_rmse")
              for suffix in ("_deg", "_deg_low", "_deg_high", "_median_deg", "_worst_deg")),
        ],
    },
}  # fmt: skip
ENTITIES = {
    "zhang2004_fig2": {"world/average", "world/eigenwalker_1/plus_2_sd", "cumulative/variance_percent"},
    "zhang2007_fig3": {"curves/absolute_error_mm2/map", "matrices/error_by_view_and_sigma2"},
    "zhang2007_fig4": {
        f"{entity}/synthetic_{walker:03d}"
        for walker in range(1, WALKERS + 1)
        for entity in (
            "world/original",
            *(f"world/reconstructed/{m}/view_{v}" for m in ("least_squares", "map") for v in (0, 30, 90)),
            *(f"image/observed/view_{v}" for v in (0, 30, 90)),
        )
    },
    "zhang2007_fig5": {
        "world/original", "world/reconstructed/least_squares", "world/reconstructed/map", "image/observed",
        "curves/absolute_error_mm2/least_squares", "curves/absolute_error_mm2/map",
        "curves/relative_error/least_squares", "curves/relative_error/map", "curves/missing_variance_mm2/truth",
    },
    "zhang2007_fig6": {
        f"curves/{curve}/{method}"
        for curve in ("estimated_deg", "error_deg", "absolute_error_median_deg")
        for method in ("least_squares", "map")
    },
}  # fmt: skip
ENTITIES["zhang2007_joint_angles"] = {
    *(f"world/{who}" for who in ("truth", "least_squares", "map", "anatomical", "average_walker")),
    *(f"curves/{angle}_deg/map" for angle in ("hip", "knee", "shoulder", "elbow")),
}
ENTITIES["zhang2007_fig2"] = ENTITIES["zhang2004_fig2"]
for _ours, _theirs in (("fig3", "fig4"), ("fig4", "fig5"), ("fig5", "fig6")):
    ENTITIES[f"zhang2004_{_ours}"] = {e for e in ENTITIES[f"zhang2007_{_theirs}"] if "/map" not in e}

# --- the anatomical reconstruction ---------------------------------------------------------------------------

PROMISED |= {
    "zhang2007_structure": {
        "table_ladder": [
            "method", "part", "views", "walkers", "absolute_error_mm2", "absolute_error_mm2_low",
            "absolute_error_mm2_high", "absolute_error_median_mm2", "absolute_error_worst_mm2",
            "below_map_percent", "below_map_percent_low", "below_map_percent_high", "below_whole_percent",
            "below_whole_percent_low", "below_whole_percent_high", "below_specified_percent",
            "below_specified_percent_low", "below_specified_percent_high", "walkers_better",
        ],
        "table_settings": [
            "walker", "method", "noise_variance_mm2", "length_factor", "pair_factor", "shrinkage", "harmonics",
        ],
        "table_sources": [
            "source", "left_out", "method", "walkers", "absolute_error_mm2", "absolute_error_mm2_low",
            "absolute_error_mm2_high", "absolute_error_median_mm2", "absolute_error_worst_mm2",
        ],
        "table_walkers": ["person", "walker", "method", "absolute_error_mm2"],
    },
    "zhang2007_coverage": {
        "table_joints": [
            "method", "bars", "joint_group", "covered_percent", "covered_percent_low", "covered_percent_high",
            "half_width_mm",
        ],
        "table_views": [
            "method", "bars", "view_angle_deg", "covered_percent", "covered_percent_low",
            "covered_percent_high", "half_width_mm",
        ],
        "table_walkers": [
            "person", "walker", "method", "bars", "covered_percent", "half_width_mm", "rms_error_mm",
        ],
        "table_walkers_joints": ["person", "walker", "method", "bars", "joint_group", "covered_percent"],
        "table_walkers_views": ["person", "walker", "method", "bars", "view_angle_deg", "covered_percent"],
    },
    "zhang2007_occlusion": {
        "table_axes": [
            "hidden", "method", "bars", "axis", "covered_percent", "covered_percent_low", "covered_percent_high",
            "half_width_mm",
        ],
        "table_bars": [
            "hidden", "method", "bars", "covered_percent", "covered_percent_low", "covered_percent_high",
            "half_width_mm",
        ],
        "table_hidden": [
            "hidden", "method", "hidden_error_mm", "hidden_error_mm_low", "hidden_error_mm_high",
            "below_map_percent", "below_map_percent_low", "below_map_percent_high", "seen_error_mm2",
            "seen_error_mm2_low", "seen_error_mm2_high", "walkers_better",
        ],
        "table_walkers": ["person", "walker", "hidden", "method", "hidden_error_mm"],
        "table_walkers_bars": ["person", "walker", "hidden", "method", "bars", "covered_percent"],
    },
    "zhang2007_noise": {
        "table_walkers": [
            "person", "walker", "condition", "method", "absolute_error_mm2", "covered_percent",
        ],
    },
    "zhang2007_view_posterior": {
        "table_bars": [
            "method", "bars", "level_percent", "covered_percent", "covered_percent_low", "covered_percent_high",
            "half_width_deg",
        ],
        "table_walkers": [
            "person", "walker", "method", "absolute_angle_error_median_deg", "absolute_angle_error_max_deg",
            "posterior_sd_deg", "covered_percent",
        ],
    },
}  # fmt: skip
ENTITIES |= {
    "zhang2007_structure": {
        *(f"curves/ladder/{m}" for m in ("average_walker", "map_70", "map_tuned", "anatomical")),
        *(f"parts/ladder/{m}" for m in ("mirror", "all_chosen", "without_constancy", "six_harmonics")),
    },
    "zhang2007_coverage": {
        "world/original", "world/reconstructed/anatomical", "image/observed",
        *(f"world/posterior/sample_{number:02d}" for number in range(1, 13)),
    },
    "zhang2007_occlusion": {
        f"curves/{hidden}/{method}"
        for hidden in ("head", "feet", "far_arm", "far_leg", "far_side")
        for method in ("average_walker", "map_tuned", "anatomical")
    },
    "zhang2007_noise": {
        f"{entity}/{method}"
        for entity in ("matrices", "curves/covered_percent")
        for method in ("map_tuned", "linear_told", "anatomical_told", "anatomical_untold")
    },
    "zhang2007_view_posterior": {
        "matrices/posterior",
        *(
            f"curves/{column}/{method}"
            for column in ("absolute_angle_error_mean_deg", "posterior_sd_deg")
            for method in ("two_harmonics", "anatomical")
        ),
    },
}  # fmt: skip

# --- keypoints ------------------------------------------------------------------------------------------------

COVERED = [f"covered_{level}{kind}_percent" for kind in ("", "_raw") for level in (50, 80, 95)]
PROMISED |= {
    "keypoints_headings": {
        "table_views": [
            "heading_deg", "clips", "view_error_median_deg", "view_error_90_deg", "view_error_worst_deg",
            "turned_percent", "cadence_error_median_percent", "wrong_cadence_percent", *COVERED,
        ],
        "table_clips": [
            "person", "walk", "heading_deg", "overground", "view_error_deg", "view_distance_deg",
            "cadence_error_percent", "residual_percent", *COVERED,
        ],
        "table_people": [
            "person", "heading_deg", "method", "error_mm", "knee_error_deg", "hip_error_deg", "shank_error_deg",
            "elbow_error_deg",
        ],
    },
}  # fmt: skip
CHANGED = ["condition", "change", "level"]
JUDGED = [
    *(f"{verdict}_percent" for verdict in ("walk", "doubtful", "not_a_walk")),
    *(f"labels_{found}_percent" for found in ("right", "unsure", "wrong_unsaid")),
]
PROMISED |= {
    figure: {
        "table_views": [*CHANGED, *PROMISED["keypoints_headings"]["table_views"][1:], *JUDGED],
        "table_clips": [*PROMISED["keypoints_headings"]["table_clips"], *CHANGED, *JUDGED],
        "table_people": ["person", *CHANGED, *PROMISED["keypoints_headings"]["table_people"][2:]],
    }
    for figure in ("keypoints_degradations", "keypoints_ablation")
}
ENTITIES |= {
    figure: {
        "image/keypoints", "image/reprojection",
        *(f"world/{body}" for body in ("truth", "keypoint_walk", "average_walker")),
        *(f"curves/error_mm/{method}" for method in ("keypoint_walk", "average_walker")),
        *(f"curves/half_width_95_mm/{axis}" for axis in ("right", "down", "away")),
    }
    for figure in ("keypoints_headings", "keypoints_degradations", "keypoints_ablation")
}  # fmt: skip

# --- mozerov2006 --------------------------------------------------------------------------------------------

STAGES = ["raw", "linear", "keyframe", "synchronized"]
LEFT = ["variance_left", "variance_left_to_linear"]
ERRORS = [
    f"{error}{column}"
    for error in ("error", "error_moving")
    for column in ("_frames", "_sd_frames", "_frames_low", "_frames_high")
]
PAIRS = [
    "performance", "person", "other", "other_person", *STAGES, "null_linear", "null_keyframe", "null_synchronized",
]  # fmt: skip
SPACE = ["components", "held_by_16", "components_uncorrelated", "held_by_16_uncorrelated"]
PROMISED |= {
    "mozerov2006_fig1": {
        "table_rates": [
            "performance", "person", "duration_s", "disparity_max_abs", "rate_min", "rate_max", "rate_sd",
            "at_rate_limit_fraction", "at_rate_limit_longest", "distance", "distance_linear", "rate_sd_null",
            "distance_null", "distance_linear_null",
        ],
        "table_pairs": PAIRS,
    },
    "mozerov2006_fig2": {
        "table_path": ["sample", "disparity", "rate_to_rate", "accumulated_cost"],
        "table_pair": [
            "pattern", "performance", "distance", "distance_linear", "least_other_distance", "other_paths",
            "smoothness",
        ],
    },
    "mozerov2006_fig3": {
        "distances": ["n", "m", "distance"],
        "table_spectrum": ["component", "eigenvalue", "variance_fraction", "cumulative_fraction", "kept"],
        "table_performances": [
            "performance", "person", "frames", "duration_s", "global_distance", "is_median", "disparity_max_abs",
            *(f"acceptance_{kind}{s}" for kind in ("", "person_") for s in STAGES[1:]),
            "distance_from_median_of_others", "distance_from_any_of_others", "variance_along_modes_of_others",
            "variance_along_numbers_of_others", "squared_from_keyframe_linear", "squared_from_keyframe_synchronized",
            "squared_deviation", "cosine_change_max", "angle_change_max",
        ],
        "table_pairs": PAIRS,
        "table_space": SPACE,
        "table_space_draws": ["draw", *SPACE],
        "table_stages": [
            "stage", *LEFT, "acceptance", "acceptance_person", "rms_from_keyframe", "rms_from_keyframe_sd",
            "rms_of_mean_from_keyframe", "rms_from_keyframe_to_deviation", "warp_from_keyframe_frames",
            "warp_from_keyframe_sd_frames",
        ],
        "table_model": [
            "sample", "component", "mean", "standard_deviation", "floored", "mean_linear", "standard_deviation_linear",
            "mean_low", "mean_high",
        ],
        "table_timing": ["what", "performances", "samples", "dimensions", "seconds"],
        "table_posture": [
            "limbs", "joints", "numbers", "numbers_per_limb", "asymmetry", "limb_norm_error_max", "cosine_change_max",
        ],
    },
    "mozerov2006_warp_error": {
        "table_starts": ["start", "penalty", "smoothness", *ERRORS],
        "table_performances": ["performance", "person", "stage", "error_moving_frames", "is_median"],
    },
    "mozerov2006_variance_left": {
        "table_stages": ["stage", *LEFT],
    },
}  # fmt: skip
ENTITIES |= {
    "mozerov2006_fig1": {
        *(f"world/{s}/{who}" for s in ("linear", "synchronized") for who in ("pattern", "performance")),
        *(f"curves/dimension_1/{s}/{w}" for s in ("linear", "synchronized") for w in ("pattern", "performance")),
        "curves/disparity/performance",
    },
    "mozerov2006_fig2": {
        "matrices/disparity_space_image", "matrices/disparity_space_image/optimal_path",
        "matrices/disparity_space_image/trellis", "curves/disparity/path", "curves/accumulated_cost/path",
        "curves/dimension_1/linear/pattern", "curves/dimension_1/synchronized/performance",
    },
    "mozerov2006_fig3": {
        "world/mean_performance", "matrices/distances",
        *(f"curves/dimension_{k}/{line}" for k in (1, 2, 3) for line in ("mean", "lower_bound", "upper_bound")),
    },
    "mozerov2006_warp_error": {
        f"curves/{curve}/{way}"
        for curve in ("error_frames", "error_moving_frames")
        for way in ("change", "as_printed", "linear", "keyframe")
    },
    "mozerov2006_variance_left": {f"curves/variance_left/{stage}" for stage in (*STAGES, "true_warp")},
}  # fmt: skip
PROMISED |= {
    "mozerov2006_fig4": {
        "table_samples": [
            "frame", "kind", "draws", "acceptance", "nearest_training_mm", "nearest_training_max_mm", "spread_mm",
            "limb_direction_norm_min", "limb_direction_norm_max", "bounds_held_fraction",
        ],
        "table_samples_draws": ["draw", "frame", "kind", "nearest_training_mm", "spread_mm"],
    },
    "mozerov2006_tracking": {
        "table_performances": [
            "performance", "person", "leave_out", "varied", "method", "particles", "noise_mm", "occluded", "error_mm",
            "aspace_error_mm", "lost_fraction",
        ],
    },
}  # fmt: skip
ENTITIES |= {
    "mozerov2006_fig4": {
        "world/mean_performance",
        *(f"world/frame_{f}/{d}" for f in (10, 40) for d in ("mean", *(f"accepted_{k}" for k in range(1, 9)))),
    },
    "mozerov2006_tracking": {
        "world/original", "image/observed",
        *(
            f"{top}/{m}"
            for top in ("world/tracked", "curves/error_mm")
            for m in ("prior", "no_prior", "no_prior_own_step", "mean_linear_phase", "mean_best_phase")
        ),
    },
}  # fmt: skip
# --- park2011 -----------------------------------------------------------------------------------------------

NULL_ENDS = [f"{null}_error_median_{end}" for null in ("hanging", "mean_pose") for end in ("low", "high")]
SKELETON_ENDS = [
    f"{name}_{end}"
    for name in (
        "relative_error_mean", "relative_error_up_to_mirror_mean", "hanging_relative_error_mean",
        "mean_pose_relative_error_mean", "imputed_error_mm_median", "seen_error_mm_median",
    )
    for end in ("low", "high")
]  # fmt: skip
PROMISED |= {
    "park2011_face_off": {
        "table_joints": ["method", "camera", "view_angle_deg", "joint", "error_mm", "error_sd_mm"],
        "table_summary": [
            "view_angle_deg", "camera", "method", "varied", "noise_px", "occluded", "heading_error_deg", "error_mm",
            "error_sd_mm", "missing_dimension_error_mm", "walkers", "people", "error_mm_low", "error_mm_high",
            "missing_dimension_error_mm_low", "missing_dimension_error_mm_high",
        ],
    },
    "park2011_fig3a": {
        "table_bins": [
            "reconstructibility_from", "reconstructibility_to", "trials", "limb_error_median", "limb_error_low",
            "limb_error_high", "success", "taken_impostor",
        ],
        "table_correlation": [
            "camera", "spearman_vector", "spearman_angle", "spearman_margin", "success", "success_up_to_mirror",
            "trials",
        ],
        "table_starts": ["start", "camera", "trial", "clip", "limb_error", "converged"],
        "table_matrices": ["camera", "numerically_singular_share", "trials"],
        "table_refinement": [
            "start", "limb_error_median", "reprojection_error_px_median", "converged_share", "success", "trials",
        ],
        "table_running": [
            "reconstructibility", "limb_error_median", "limb_error_low", "limb_error_high", "limb_error_median_low",
            "limb_error_median_high",
        ],
    },
    "park2011_fig3b": {
        "table_cameras": [
            "camera", "root_error_ratio", "trials", "child_error_median", "child_error_low", "child_error_high",
            "child_error_sd", "share_above_parent_error", "limb_error_median", "error_up_to_mirror_median",
            "hanging_error_median", "mean_pose_error_median", "child_error_median_low", "child_error_median_high",
            *NULL_ENDS,
        ],
        "table_trials": [
            "trial", "clip", "limb", "camera", "root_error_ratio", "child_error_ratio", "parent_error_ratio",
            "limb_error", "error_up_to_mirror", "hanging_error", "mean_pose_error",
        ],
        "table_points": [
            "camera", "root_error_ratio", "trials", "child_error_median", "child_error_low", "child_error_high",
            "child_error_sd", "share_above_parent_error", "limb_error_median", "error_up_to_mirror_median",
            "hanging_error_median", "mean_pose_error_median", "child_error_median_low", "child_error_median_high",
            *NULL_ENDS,
        ],
    },
    "park2011_fig3c": {
        "table_cameras": [
            "camera", "radius_scale", "adjust", "trials", "limb_error_median", "limb_error_low", "limb_error_high",
            "adjusted_share", "error_up_to_mirror_median", "hanging_error_median", "mean_pose_error_median",
            "adjusted_hanging_error_median", "limb_error_median_low", "limb_error_median_high", *NULL_ENDS,
            "adjusted_hanging_error_median_low", "adjusted_hanging_error_median_high",
        ],
        "table_trials": [
            "trial", "clip", "limb", "camera", "radius_scale", "adjust", "limb_error", "error_up_to_mirror",
            "radius_ratio", "adjusted_hanging_error", "hanging_error", "mean_pose_error",
        ],
        "table_points": [
            "camera", "radius_scale", "adjust", "trials", "limb_error_median", "limb_error_low", "limb_error_high",
            "adjusted_share", "error_up_to_mirror_median", "hanging_error_median", "mean_pose_error_median",
            "adjusted_hanging_error_median", "limb_error_median_low", "limb_error_median_high", *NULL_ENDS,
            "adjusted_hanging_error_median_low", "adjusted_hanging_error_median_high",
        ],
    },
    "park2011_fig3d": {
        "table_points": [
            "missing_fraction", "pattern", "trials", "relative_error_mean", "relative_error_sd",
            "limb_error_median", "joint_error_mm_median", "imputed_error_mm_median", "seen_error_mm_median",
            "relative_error_up_to_mirror_mean", "hanging_relative_error_mean", "mean_pose_relative_error_mean",
            "limb_error_up_to_mirror_median", *SKELETON_ENDS,
        ],
        "table_hinges": ["trial", "clip", "missing_fraction", "relative_error", "joint_error_mm"],
    },
    "park2011_fig4": {
        "table_clips": [
            "clip", "action", "camera", "lengths", "error_mm", "error_sd_mm", "error_up_to_mirror_mm",
            "length_change_max", "acceleration_ratio", "hanging_error_mm", "mean_pose_error_mm",
            "reprojection_error_px", "proved_share", "confidence",
            "mirror_margin_median", "reconstructibility",
        ],
        "table_papers": [
            "clip", "action", "camera", "error_mm", "error_sd_mm", "error_up_to_mirror_mm", "length_change_max",
            "acceleration_ratio", "hanging_error_mm", "true_root_error_mm", "camera_outside_basis",
            "mean_pose_error_mm",
        ],
        "table_limbs": [
            "clip", "action", "camera", "limb", "reconstructibility", "mirror_margin", "confidence", "mirrored",
            "proved", "objective", "best_objective", "lower_bound", "limb_error", "components", "length_ratio",
        ],
    },
    "park2011_proofs": {
        "table_timing": [
            "frames", "components", "noise_px", "trials", "seconds_median", "seconds_to_proof_median",
            "seconds_most", "first_seconds_median",
        ],
        "table_trials": [
            "frames", "components", "noise_px", "trial", "clip", "limb", "camera", "proved", "objective",
            "lower_bound", "gap", "first_objective", "limb_error", "boxes", "steps",
        ],
    },
}  # fmt: skip
ENTITIES |= {
    "park2011_fig3a": {
        *(f"curves/limb_error/{line}" for line in ("low", "median", "high")),
        *(
            f"world/{limb}/{path}"
            for limb in ("good", "impostor", "cursor")
            for path in ("truth", "impostor", "estimate", "sphere")
        ),
    },
    "park2011_fig3b": {"curves/child_error/parent", "world/truth", "world/estimate", "world/sphere"},
    "park2011_fig3c": {
        "world/truth", "world/estimate", "world/sphere",
        *(f"curves/log10_limb_error/{adjust}" for adjust in ("refined", "global", "per_frame", "robust")),
    },
    "park2011_fig3d": {
        "image/observed", "world/original", "world/reconstructed", "world/imputed", "curves/error_mm/imputed",
        "curves/error_mm/seen",
    },
    "park2011_proofs": {
        f"curves/{curve}/k{k}_noise_{noise}_px"
        for curve in ("proved_share", "log10_seconds")
        for k in (10, 20)
        for noise in (0, 1)
    },
    "park2011_fig4": {
        f"{entity}/{clip}"
        for entity in (
            "world/truth", "world/trajectories/truth",
            *(f"{e}/{c}" for e in ("image", "world/trajectories") for c in ("still", "moving", "shaky")),
        )
        for clip in ("walking_001", "bending_001", "smooth_angles_001")
    },
    "park2011_face_off": {
        "world/original",
        *(f"image/observed/{camera}" for camera in ("still", "moving", "shaky")),
        *(
            f"{top}/{camera}/{method}"
            for top in ("world/reconstructed", "curves/error_mm")
            for camera in ("still", "moving", "shaky")
            for method in (
                "articulated", "articulated_hinges", "articulated_mirrors", "mean_walker",
                *(("least_squares", "map", "image_and_average") if camera == "still" else ()),
            )
        ),
    },
}  # fmt: skip
MAY_BE_EMPTY = {
    # The interval over people of a heading from which a single person was filmed.
    ("keypoints_headings", "table"): {
        f"{error}_{end}"
        for error in ("error_mm", "knee_error_deg", "hip_error_deg", "shank_error_deg", "elbow_error_deg")
        for end in ("low", "high")
    },
    ("mozerov2006_fig3", "table_stages"): {
        "acceptance", "acceptance_person", "rms_from_keyframe", "rms_from_keyframe_sd", "rms_of_mean_from_keyframe",
        "rms_from_keyframe_to_deviation", "warp_from_keyframe_frames", "warp_from_keyframe_sd_frames",
    },
    # Intervals over people, or clips, of figures or points that have a single one.
    ("mozerov2006_tracking", "table"): {"error_mm_low", "error_mm_high"},
    ("park2011_face_off", "table_summary"): {
        f"{error}_mm_{end}" for error in ("error", "missing_dimension_error") for end in ("low", "high")
    },
    ("park2011_fig3a", "table_running"): {"limb_error_median_low", "limb_error_median_high"},
    ("mozerov2006_warp_error", "table"): {"smoothness"},
    ("mozerov2006_warp_error", "table_starts"): {"smoothness"},
    ("park2011_fig3d", "table"): {"imputed_error_mm", "hanging_imputed_error_mm", "mean_pose_imputed_error_mm"},
    ("park2011_fig3d", "table_points"): {"imputed_error_mm_median", *SKELETON_ENDS},
}  # fmt: skip
"""Columns with rows that have no such number."""
PROMISED["park2011_mirrors"] = {
    name: columns for name, columns in PROMISED["park2011_fig4"].items() if name != "table_papers"
}
ENTITIES["park2011_mirrors"] = ENTITIES["park2011_fig4"]
for _figure, _tables in PROMISED.items():
    _header = (GOLDEN / f"{_figure}.csv").read_text(encoding="utf-8").partition("\n")[0]
    PROMISED[_figure] = {"table": _header.split(","), **_tables}
