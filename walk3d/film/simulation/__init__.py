"""Simulated films: cameras, detectors, and the motion of people in front of the camera."""
