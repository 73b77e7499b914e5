"""Diagnostics of an answer: residual tests, other minima, fault hypotheses, and the findings from which a verdict follows.

They change no answer: where one meets a better minimum, the search goes on from it, and a finding says so.
"""
