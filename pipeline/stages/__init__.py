"""The five stages of an experiment: ``ingest → dataset → model → sweep → figure``.

A stage knows no study by name.  It asks the store for the artefact of its options, inputs and sources, and calls the
option's method if there is none.
"""
