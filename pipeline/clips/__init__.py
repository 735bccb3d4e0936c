"""Usable clips of a data set: steady walks, performances of an action, varied motion."""
