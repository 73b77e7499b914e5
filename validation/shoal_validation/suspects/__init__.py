"""Whether an identification names what is wrong with a model, and leaves right ones alone."""
