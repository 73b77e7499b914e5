"""The commands of `shoal`, by what they are about. Each calls one plain function, which it imports when it runs."""
