"""What the evidence allows to say about an answer: residual tests, rivals, suspects, and the verdict."""
