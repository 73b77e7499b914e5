"""Study of fault hypotheses: wrong models whose cause is named, and right ones that are left alone."""
