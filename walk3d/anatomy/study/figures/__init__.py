"""Figures of the anatomical prior."""
