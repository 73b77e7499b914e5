"""One HTTP program that serves one engine: `shoal serve gauss | exudyn | casadi`.

The program itself computes nothing: it checks who asks and how much, and hands the rest to worker processes.
"""
