"""The whole of Shoal as plain processes: the commands of the Procfile, in order."""
