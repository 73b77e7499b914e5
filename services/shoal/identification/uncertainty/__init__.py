"""How well the answer is known: derivatives, covariance, intervals, profiles, and the model's own error."""
