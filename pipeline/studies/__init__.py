"""The studies: options, datasets, models, sweeps, figures and measures of walks, actions and limbs."""
