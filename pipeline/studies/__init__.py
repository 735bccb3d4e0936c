"""Studies of walks, actions and limbs: options, datasets, models, sweeps, figures and measures."""
