"""Simulated films: cameras, detectors and people as they make them."""
