"""The anatomical prior: mirror images, shrinkage and bones of constant length, with error bars."""
