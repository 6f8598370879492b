"""What the module Covol of 3D Slicer does: job.py, and what it shares with covol's other plugins."""
