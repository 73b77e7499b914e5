"""Pictures, one file each: a function from results to a Matplotlib figure; and pages made of them."""
