"""Speed, side by side in one run, as ratios against the peer a user would pick. Run by hand or nightly."""
