"""What is left when the program is killed, interrupted, or cannot write."""
