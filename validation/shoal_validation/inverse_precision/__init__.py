"""Identification: error of the parameters against time and counted evaluations, and where it can be trusted."""
