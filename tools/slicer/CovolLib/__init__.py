"""Functions of the module Covol of 3D Slicer: job.py, and code shared with covol's other plugins."""
