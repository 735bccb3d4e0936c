"""The five stages of an experiment: ``ingest → dataset → model → sweep → figure``.

A stage does not depend on any study.  It looks up the artefact of its options, inputs and sources in the store, and
calls the option's method if the store does not have it.
"""
