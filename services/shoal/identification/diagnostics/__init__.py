"""Diagnostics of an answer: residual tests, other minima, fault hypotheses, and the findings that make a verdict.

They change no answer: where one meets a better minimum, the search goes on from it, and a finding says so.
"""
