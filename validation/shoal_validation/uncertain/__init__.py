"""Methods for uncertain parameters against bounds in closed form: accuracy by runs, and who errs in silence."""
