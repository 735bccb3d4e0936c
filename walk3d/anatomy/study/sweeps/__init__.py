"""Sweeps of the anatomical reconstruction: ablation, coverage of bars, hidden joints, other laboratories."""
