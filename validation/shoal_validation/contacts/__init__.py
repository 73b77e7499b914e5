"""Contacts beside other formulations: cost of an error, maps of where answers are wrong, identification."""
