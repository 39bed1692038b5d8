"""Bags: opened, repaired, decoded, and read into runs; written."""
