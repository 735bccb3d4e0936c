"""The anatomical prior: mirror images, shrinkage, bones of constant length, and error bars."""
