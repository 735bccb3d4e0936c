"""Data sets and their recordings; other packages use formats, mappings and fetch only through this one."""
