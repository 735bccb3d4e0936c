"""What a data set names becomes clips that can be used: steady walks, performances of an action, varied motion."""
