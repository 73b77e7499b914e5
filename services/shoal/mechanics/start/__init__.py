"""The start of a machine: poses and rates that agree with its joints and with the stated values."""
