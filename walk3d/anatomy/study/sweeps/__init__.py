"""Sweeps of the anatomical reconstruction: ablation, error bars, hidden joints, other laboratories."""
