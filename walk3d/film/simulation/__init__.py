"""Simulated films: cameras, detectors, and people in front of the camera."""
