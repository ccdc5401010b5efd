"""What single commands do, where it is more than a few lines."""
