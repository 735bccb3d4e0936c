"""The five stages of an experiment, each thin: when a study's option does its work, from what, and where it is kept.

``ingest → dataset → model → sweep → figure``.  A stage knows no study by name; it asks the store for the artefact of
these options, these inputs and these sources, and calls the option's method if there is none.
"""
