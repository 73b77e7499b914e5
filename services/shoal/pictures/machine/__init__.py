"""Symbols of a machine: joints, springs, drives, loads and bodies as a drawing shows them, for pages and stills."""
