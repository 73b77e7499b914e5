"""The night: every problem on every engine, held against its reference and against the nights before."""
